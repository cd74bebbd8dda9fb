# On a fresh Debian or Ubuntu machine with Python >= 3.11 and make, each target first provides
# what it needs: system packages (by apt, if permitted) and a virtual environment.
#
#   make demo     render a scene and look at it from the left, centre and right: out/demo/
#   make test     the whole test suite with reduced counts
#   make verify   the test suite with full counts; writes docs/verify/<date>.md
#   make lint     ruff and mypy
#   make clean    remove what these made, except the environment
#
# PYTHON=... chooses the interpreter, VENV=... the environment's folder, EXTRAS=dev,ray what tests
# may use: those of Ray Serve skip without it, since it takes 240 MB.

VENV ?= .venv
EXTRAS ?= dev
BIN = $(VENV)/bin

.PHONY: demo test verify lint clean system system-test
.NOTPARALLEL:
.DEFAULT_GOAL = demo

demo: system $(VENV)/base.stamp
	@mkdir -p out
	$(BIN)/lfd-render demo out/demo

test: system-test $(VENV)/dev.stamp
	$(BIN)/python -m pytest -n 2 --dist loadfile

verify: system-test $(VENV)/dev.stamp
	LFD_FULL=1 PYTHONPATH=tests $(BIN)/python -m pytest -p verify_page

lint: $(VENV)/dev.stamp
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

clean:
	rm -rf build dist out lfd_render.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -not -path './$(VENV)/*' -prune -exec rm -rf {} +

# Asked anew each time, which takes a fifth of a second: a stamp would not notice a removed package.
system:
	@./bootstrap.sh system gl venv

system-test:
	@./bootstrap.sh system gl venv zink? browser?

# Linting needs no GL, so an environment asks for its own system package alone.
$(VENV)/base.stamp: pyproject.toml
	@./bootstrap.sh system venv
	@./bootstrap.sh venv $(VENV) ""
	@touch $@

$(VENV)/dev.stamp: pyproject.toml
	@./bootstrap.sh system venv
	@./bootstrap.sh venv $(VENV) "[$(EXTRAS)]"
	@touch $@ $(VENV)/base.stamp

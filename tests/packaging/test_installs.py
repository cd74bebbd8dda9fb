"""Wheel, sdist and editable install each run the command line from another folder.

The quick tests install without dependencies into an environment that sees this one's packages, so
they need no network; the full run installs with dependencies into a bare environment.
"""

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import venv
from pathlib import Path
from typing import Any

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
NOT_SOURCE = shutil.ignore_patterns(".*", "*.egg-info", "__pycache__", "build", "dist", "out")


def run(*command: object, cwd: Path) -> str:
    """Run a command; its stdout. Variables that steer Python are left out."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    done = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the checkout, so that building leaves nothing in it."""
    copy = tmp_path_factory.mktemp("source") / "lfd_render"
    return shutil.copytree(REPOSITORY, copy, ignore=NOT_SOURCE)


@pytest.fixture(scope="module")
def built(checkout: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the sdist, and the wheel that was built from the sdist."""
    folder = tmp_path_factory.mktemp("built")
    build = (sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, checkout)
    run(*build, cwd=folder)
    return folder


def source(kind: str, checkout: Path, built: Path) -> list[object]:
    """What pip is to install."""
    if kind == "editable":
        return ["--editable", checkout]
    return [next(built.glob("*.whl" if kind == "wheel" else "*.tar.gz"))]


def check(python: Path, folder: Path) -> None:
    """The command line of an environment answers, finds its data files, and renders."""
    program = python.with_name("lfd-render")
    assert run(program, "--version", cwd=folder).startswith("lfd-render ")
    script = "import lfd_render; print(lfd_render.__file__)"
    home = Path(run(python, "-c", script, cwd=folder).strip())
    assert REPOSITORY not in home.parents
    report: dict[str, Any] = json.loads(
        run(program, "render", "builtin:spheres?triangles=1000", "-o", "eia.png", "--views", "4",
            "--json", cwd=folder)
    )  # fmt: skip
    assert report["views"] == 4
    assert (folder / "eia.png").stat().st_size > 10_000


@pytest.mark.needs("gl")
@pytest.mark.shows("Wheel, sdist and editable install each run the CLI from another folder")
@pytest.mark.parametrize("kind", ["wheel", "sdist", "editable"])
def test_it_runs_from_another_folder(
    kind: str, checkout: Path, built: Path, tmp_path: Path
) -> None:
    environment = tmp_path / "environment"
    venv.create(environment)
    python = environment / "bin" / "python"
    ours = sysconfig.get_path("purelib")
    theirs = run(
        python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=tmp_path
    )
    (Path(theirs.strip()) / "ours.pth").write_text(ours + "\n", encoding="utf-8")
    run(
        sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-index",
        "--no-deps", "--no-build-isolation", "--ignore-installed", *source(kind, checkout, built),
        cwd=tmp_path,
    )  # fmt: skip
    check(python, tmp_path)


@pytest.mark.parametrize("kind", ["wheel", "sdist", "editable"])
def test_it_installs_with_its_dependencies(
    kind: str, checkout: Path, built: Path, tmp_path: Path, full_counts: bool
) -> None:
    if not full_counts:
        pytest.skip("[network] installs with dependencies: in the full run only")
    environment = tmp_path / "environment"
    venv.create(environment, with_pip=True)
    python = environment / "bin" / "python"
    run(python, "-m", "pip", "install", "--quiet", *source(kind, checkout, built), cwd=tmp_path)
    check(python, tmp_path)


def test_nothing_generic_lands_in_site_packages(built: Path, tmp_path: Path) -> None:
    wheel = next(built.glob("*.whl"))
    shutil.unpack_archive(wheel, tmp_path, format="zip")
    tops = {path.name.split("-")[0] for path in tmp_path.iterdir()}
    assert tops == {"lfd_render"}


def test_the_page_is_in_the_wheel(built: Path, tmp_path: Path) -> None:
    shutil.unpack_archive(next(built.glob("*.whl")), tmp_path, format="zip")
    page = {path.name for path in (tmp_path / "lfd_render" / "service" / "web").iterdir()}
    assert page == {path.name for path in (REPOSITORY / "service" / "web").iterdir()}


def test_every_package_is_listed() -> None:
    text = (REPOSITORY / "pyproject.toml").read_text(encoding="utf-8")
    setuptools = tomllib.loads(text)["tool"]["setuptools"]
    inits = (REPOSITORY / "lfd_render").rglob("__init__.py")
    folders = {path.parent.relative_to(REPOSITORY).as_posix().replace("/", ".") for path in inits}
    assert set(setuptools["packages"]) == folders | set(setuptools["package-dir"])

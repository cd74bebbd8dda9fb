"""The README's commands and its Python example work as they stand there."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
README = (REPOSITORY / "README.md").read_text(encoding="utf-8")
SMALL = "builtin:spheres?triangles=1000"


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def commands(program: str) -> list[list[str]]:
    lines = [line for block in blocks("sh") for line in block.splitlines()]
    found = (shlex.split(line, comments=True) for line in lines)
    return [words for words in found if words and words[0] == program]


def test_make_targets_exist() -> None:
    makefile = (REPOSITORY / "Makefile").read_text(encoding="utf-8")
    targets = {word for words in commands("make") for word in words[1:]}
    assert {"demo", "test"} <= targets
    assert all(re.search(rf"^{target}:", makefile, re.MULTILINE) for target in targets)


@pytest.mark.needs("gl")
def test_command_lines_work(tmp_path: Path) -> None:
    for words in commands("lfd-render"):
        if words[1] == "serve":  # tests/http starts it
            continue
        arguments = [SMALL if word == "scene.gltf" else word for word in words[1:]]
        command = [sys.executable, "-m", "lfd_render.cli.main", *arguments]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    assert {"eia.png", "seen.png", "views"} <= {path.name for path in tmp_path.iterdir()}


@pytest.mark.needs("gl")
def test_python_example_works(tmp_path: Path) -> None:
    for block in blocks("python"):
        script = block.replace("builtin:spheres", SMALL)
        subprocess.run([sys.executable, "-c", script], cwd=tmp_path, check=True)
    assert (tmp_path / "eia.png").is_file()

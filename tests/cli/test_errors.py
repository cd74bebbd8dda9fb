"""Every way to fail: the exit code, one line on stderr, nothing on stdout, no file left."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from lfd_render import errors

from .conftest import Command, FakeRenderer


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (errors.UsageError("views: 0"), 2),
        (errors.SceneError("a.gltf: mesh 3: index 9"), 3),
        (errors.ProfileError("b.json: lens_count"), 4),
        (errors.GpuError("no device"), 5),
        (errors.ResourceError("too many"), 6),
        (MemoryError("30 GiB"), 6),
        (errors.PictureError("c.png"), 7),
        (errors.OutputError("d.png"), 8),
        (KeyboardInterrupt(), 130),
        (RuntimeError("first\nsecond \x1b[31mred"), 1),
    ],
)
def test_errors_become_exit_codes(
    command: Command,
    renderer: FakeRenderer,
    scene: Path,
    display: Path,
    tmp_path: Path,
    error: BaseException,
    code: int,
) -> None:
    renderer.error = error
    result = command("render", scene, "-o", tmp_path / "a.png", "-d", display, "--json")
    assert result.code == code
    assert result.stdout == ""
    text = " ".join(str(error).split()).replace("\x1b", "\N{REPLACEMENT CHARACTER}")
    assert text in result.error
    assert ("LFD_DEBUG=1" in result.error) == (code == 1)
    assert list(tmp_path.iterdir()) == []


def test_debug_shows_the_traceback(
    command: Command,
    renderer: FakeRenderer,
    scene: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("LFD_DEBUG", "1")
    renderer.error = RuntimeError("deep down")
    result = command("render", scene, "-o", tmp_path / "a.png")
    assert "Traceback" in result.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "--help"),
        (("dance",), "dance"),
        (("render",), "SCENE"),
        (("render", "x.glb"), "--output"),
        (("render", "x.glb", "-o", "a.png", "--views", "0"), "--views"),
        (("render", "x.glb", "-o", "a.png", "--views", "many"), "--views"),
        (("render", "x.glb", "-o", "a.png", "--view-size", "480"), "480x360"),
        (("render", "x.glb", "-o", "a.png", "--view-size", "0x9"), "0x9"),
        (("render", "x.glb", "-o", "a.png", "--technique", "magic"), "magic"),
        (("render", "x.glb", "-o", "a.png", "--preset", "best"), "best"),
        (("render", "x.glb", "-o", "a.png", "--spacing", "even"), "even"),
        (("render", "x.glb", "-o", "a.png", "--lod", "trilinear"), "trilinear"),
        (("render", "x.glb", "-o", "a.png", "--seed", "-1"), "--seed"),
        (("render", "x.glb", "-o", "a.png", "--repeat", "0"), "--repeat"),
        (("render", "x.glb", "-o", "a.png", "--device", "cuda"), "cuda"),
        (("render", "x.glb", "-o", "a.png", "--colour", "red"), "--colour"),
        (("render", "builtin:spheres", "-o", "a.png", "--yaw", "nan"), "--yaw"),
        (("render", "builtin:spheres", "-o", "a.png", "--depth-scale", "0"), "--depth-scale"),
        (("views", "x.glb", "-o", "a", "--views", "0"), "--views"),
        (("look", "x.png", "-o", "a.png"), "--angle"),
        (("doctor", "--device", "fast"), "fast"),
        (("render", "x.glb", "-o", "a.png", "--format", "tif"), "--format"),
        (("quilt", "x.glb"), "--output"),
        (
            ("quilt", "x.glb", "-o", "a", "--tiles", "8"),
            "--tiles: '8'; give columns x rows, as 8x6",
        ),
        (("quilt", "x.glb", "-o", "a", "--size", "big"), "--size"),
        (
            ("quilt", "x.glb", "-o", "a", "--quilt", "vision"),
            "'vision' is not known; give portrait",
        ),
        (("quilt", "x.glb", "-o", "a", "--quilt", "go", "--tiles", "8x6"), "leave tiles"),
        (("quilt", "x.glb", "-o", "a", "--tiles", "40x40"), "40 x 40 are too many"),
        (
            ("quilt", "x.glb", "-o", "a", "--tiles", "8x6", "--size", "99x99"),
            "99x99 does not divide",
        ),
        (("quilt", "x.glb", "-o", "a_qs5x9a1.777.png"), "a_qs5x9a1.777.png: names 5 x 9 views"),
        (("quilt", "x.glb", "-o", "a.jpg"), "a quilt is written as .png"),
        (("weave", "x.png"), "--output"),
        (("weave", "x.png", "-o", "a.tif"), ".png or .exr or .raw"),
        (("weave", "x.png", "-o", "a.png", "--tiles", "x"), "--tiles"),
        (("weave", ".", "-o", "a.png", "--tiles", "8x6"), "a folder of views has none"),
        (("unweave", "x.png"), "or --check-display"),
        (("unweave", "x.png", "-o", "-"), "give a folder"),
        (("unweave", "x.png", "-o", "a", "--error-picture", "b.png"), "add --check-display"),
        (("unweave", "x.png", "--check-display", "y", "--error-picture", "b.tif"), "'.tif'"),
        (("unweave", "x.png", "-o", "a", "--rows", "0"), "--rows"),
    ],
)
def test_usage_errors(
    command: Command,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    result = command(*arguments)
    assert result.code == 2
    assert result.stdout == ""
    assert words in result.error
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("render", "missing.glb", "-o", "a.png"), 3, "missing.glb"),
        (("render", "builtin:nothing", "-o", "a.png"), 3, "nothing"),
        (("render", "builtin:spheres", "-o", "a.png", "--camera", "missing.json"), 3, "missing"),
        (("render", "builtin:spheres", "-o", "a.png", "-d", "missing.json"), 4, "missing.json"),
        (("render", "builtin:spheres", "-o", "a.png", "-d", "nothing"), 4, "nothing"),
        (("look", "missing.png", "--angle", "0", "-o", "a.png"), 7, "missing.png"),
        (("views", "builtin:spheres", "-o", "no/a"), 8, "no"),
        (("quilt", "builtin:nothing", "-o", "a"), 3, "nothing"),
        (("quilt", "builtin:spheres", "-o", "no/a"), 8, "no such folder"),
        (("weave", "missing_qs8x6a0.75.png", "-o", "a.png"), 7, "missing_qs8x6a0.75.png"),
        (("weave", ".", "-o", "a.png"), 7, "views.json: No such file"),
        (("unweave", "missing.png", "-o", "a"), 7, "missing.png"),
        (("unweave", "missing.png", "-o", "a", "--check-display", "nothing"), 4, "nothing"),
    ],
)
def test_bad_input(
    command: Command,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    code: int,
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    result = command(*arguments)
    assert result.code == code
    assert result.stdout == ""
    assert words in result.error
    assert list(tmp_path.iterdir()) == []


def test_version(command: Command) -> None:
    result = command("--version")
    assert result.code == 0
    assert result.stdout.startswith("lfd-render ")


def test_help_imports_nothing_heavy() -> None:
    script = "import sys, lfd_render.cli.main; print(*sorted(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert not {"numpy", "moderngl", "PIL", "rich"} & set(done.stdout.split())


def test_a_closed_pipe_is_an_output_error() -> None:
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-m", "lfd_render.cli.main", "doctor", "--json"]
    done = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, text=True, check=False)
    os.close(write)
    assert done.returncode == 8
    assert done.stderr.startswith("lfd-render: error: stdout: ")
    assert done.stderr.count("\n") == 1

"""`lfd-render animate`: sequences that are ended anywhere and go on from there."""

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from lfd_render.engine.choices import Choices
from lfd_render.engine.frame_store import FolderStore, UrlStore
from lfd_render.engine.manifest import MANIFEST, Manifest
from lfd_render.engine.motion import Motion
from lfd_render.errors import OptionError, OutputError
from lfd_render.panel.picture import read_picture

from .conftest import Command

SCENE = "builtin:spheres?triangles=1000"
MOVING = ("--motion", "sway", "--fps", 10, "--period", 4)


def begun(*arguments: object) -> "subprocess.Popen[bytes]":
    """The command line, begun in a process of its own."""
    command = [sys.executable, "-m", "lfd_render.cli.main", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def run(*arguments: object) -> "subprocess.CompletedProcess[str]":
    """The command line in a process of its own, which succeeds."""
    command = [sys.executable, "-m", "lfd_render.cli.main", *map(str, arguments)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert ended.returncode == 0, ended.stderr
    return ended


def frames(folder: Path) -> list[Path]:
    """What a person sees in a folder of frames."""
    return sorted(path for path in folder.iterdir() if path.name[0] == "f")


def bytes_of(folder: Path) -> list[bytes]:
    return [path.read_bytes() for path in frames(folder)]


@pytest.fixture(scope="module")
def whole(display: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of four frames."""
    folder = tmp_path_factory.mktemp("whole") / "frames"
    run("animate", SCENE, "-o", folder, "-d", display, *MOVING, "--frames", "0:3", "--processes", 2)
    return folder


@pytest.fixture
def made(whole: Path, tmp_path: Path) -> Path:
    """A copy of it, to be spoilt."""
    return Path(shutil.copytree(whole, tmp_path / "frames"))


@pytest.mark.needs("gl")
@pytest.mark.shows("frames killed with kill -9 and resumed: all right, none twice, none partial")
def test_a_sequence_survives_kill_9(
    display: Path,
    tmp_path: Path,
    scaled: Callable[[int, int], int],
    rng: np.random.Generator,
    measured: Callable[[str, str], None],
) -> None:
    count, kills = scaled(60, 16), scaled(5, 2)
    folder, straight = tmp_path / "killed", tmp_path / "straight"
    arguments = ("animate", SCENE, "-d", display, *MOVING, "--frames", f"0:{count - 1}")
    arguments = (*arguments, "--processes", 2)
    seen: dict[str, tuple[int, int]] = {}  # file by file, what a rewrite would change
    for kill in range(kills):
        process = begun(*arguments, "-o", folder, *(["--resume"] if kill else []))
        there = len(seen)
        wanted = there + rng.integers(1, (count - there) // (kills - kill))
        while process.poll() is None and (not folder.exists() or len(frames(folder)) < wanted):
            time.sleep(0.001)
        time.sleep(rng.uniform(0, 0.02))
        process.kill()
        process.wait()
        for path in frames(folder):
            read_picture(path)
            known = (path.stat().st_ino, path.stat().st_mtime_ns)
            assert seen.setdefault(path.name, known) == known
    ended = run(*arguments, "-o", folder, "--resume", "--json")
    # What a kill left under a hidden name, written whole, is not made again either.
    assert json.loads(ended.stdout)["made"] <= count - len(seen)
    for path in frames(folder):
        known = (path.stat().st_ino, path.stat().st_mtime_ns)
        assert seen.setdefault(path.name, known) == known
    assert {path.name for path in folder.iterdir()} == seen.keys() | {MANIFEST}
    run(*arguments, "-o", straight)
    assert len(frames(straight)) == count
    assert bytes_of(folder) == bytes_of(straight)
    measured("killed sequences", f"{kills} kills, {count} of {count} frames right, none twice")


@pytest.mark.needs("gl")
def test_a_frame_is_what_render_makes(whole: Path, display: Path, tmp_path: Path) -> None:
    yaw = Motion("sway", period=4).at(Choices(), 3 / 10).yaw
    assert yaw > 5
    single = tmp_path / "single.png"
    run("render", SCENE, "-o", single, "-d", display, f"--yaw={yaw!r}")
    assert single.read_bytes() == frames(whole)[3].read_bytes()
    assert single.read_bytes() != frames(whole)[0].read_bytes()


@pytest.mark.needs("gl")
def test_resume_makes_what_is_missing_or_broken_and_more(
    made: Path, whole: Path, display: Path
) -> None:
    first, second, third, _ = frames(made)
    kept = first.stat().st_mtime_ns
    second.unlink()
    third.write_bytes(third.read_bytes()[:-9])
    (made / f".frame_000004.png.{'0' * 64}.part").write_bytes(b"half")
    with (made / MANIFEST).open("a") as file:
        file.write('{"file": "frame_0000')
    ended = run(
        "animate", SCENE, "-o", made, "-d", display, *MOVING, "--frames", "0:4", "--resume",
        "--json", "--processes", 1,
    )  # fmt: skip
    assert json.loads(ended.stdout)["made"] == 3
    assert "2 frames, the first frame_000001.png, are gone, broken" in ended.stderr
    assert first.stat().st_mtime_ns == kept
    assert bytes_of(made)[:4] == bytes_of(whole)
    assert {p.name for p in made.iterdir()} == {f"frame_00000{n}.png" for n in range(5)} | {
        MANIFEST
    }
    manifest = Manifest.parse((made / MANIFEST).read_text(), "manifest")
    assert len(manifest.hashes) == 5


@pytest.mark.needs("gl")
@pytest.mark.parametrize(
    ("arguments", "name", "size"),
    [
        (("--format", "exr"), "frame_000007.exr", (192, 108)),
        (("--picture", "quilt", "--tiles", "4x2", "--size", "160x60"),
         "frame_000007_qs4x2a1.77778.png", (160, 60)),
        (("--picture", "look", "--angle", 5, "--size", "48x27"), "frame_000007.png", (48, 27)),
    ],
)  # fmt: skip
def test_other_pictures(
    arguments: tuple[object, ...], name: str, size: tuple[int, int], display: Path, tmp_path: Path
) -> None:
    run(
        "animate", SCENE, "-o", tmp_path / "o", "-d", display, "--motion", "dolly", "--frames", 7,
        "--processes", 1, *arguments,
    )  # fmt: skip
    (file,) = frames(tmp_path / "o")
    assert file.name == name
    picture = oiio.ImageBuf(str(file))
    assert (picture.spec().width, picture.spec().height) == size
    assert np.asarray(picture.get_pixels()).std() > 0.01


@pytest.mark.needs("gl")
def test_a_scene_that_cannot_be_read_leaves_nothing(
    command: Command, display: Path, tmp_path: Path
) -> None:
    scene, out = tmp_path / "broken.glb", tmp_path / "out"
    scene.write_bytes(b"glTF")
    result = command("animate", scene, "-o", out, "-d", display, *MOVING, "--frames", "0:1")
    assert result.code == 3
    assert "broken.glb" in result.error
    assert not out.exists()


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("--frames", "9:3"), 2, "--frames: '9:3' runs backwards; give 3:9"),
        (("--frames", "a"), 2, "--frames: 'a'; give FIRST:LAST"),
        (("--frames", "0:1000000"), 2, "numbers go up to 999999"),
        (("--fps", 0), 2, "--fps: 0.0; give a number above 0"),
        (("--period", "nan"), 2, "--period: nan"),
        (("--swing", 90), 2, "--swing: 90.0; give degrees"),
        (("--engine", "slurm"), 2, "--engine: 'slurm'; give local, ray"),
        (("--picture", "quilt", "--format", "exr"), 2, "--format: exr is for panel images"),
        (("--picture", "quilt", "--views", 5), 2, "--views: a quilt's tiles say"),
        (("--tiles", "2x2"), 2, "--tiles: does not go with --picture eia"),
        (("--picture", "look", "--angle", 99), 2, "angle"),
        (("-o", "/proc/nowhere"), 8, "/proc"),
        (("-o", "none/frames"), 8, "none: no such folder"),
        (("--display", "none"), 4, "none"),
    ],
)  # fmt: skip
def test_bad_requests(
    arguments: tuple[object, ...], code: int, message: str, command: Command, tmp_path: Path,
    display: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    given = ("animate", SCENE, "-o", "out", "-d", display, *MOVING, "--frames", "0:3", *arguments)
    result = command(*given)
    assert result.code == code
    assert message in result.error
    assert list(tmp_path.iterdir()) == []


@pytest.mark.needs("gl")
def test_a_folder_with_a_sequence_needs_resume(made: Path, command: Command, display: Path) -> None:
    result = command("animate", SCENE, "-o", made, "-d", display, *MOVING, "--frames", "0:3")
    assert result.code == 8
    assert "holds a sequence already; --resume goes on with it" in result.error


@pytest.mark.needs("gl")
@pytest.mark.parametrize(
    ("arguments", "setting"),
    [
        (("--fps", 11), "'fps' is 10.0 there and 11.0 now"),
        (("--yaw", 2), "'yaw' is 0.0 there and 2.0 now"),
        (("--motion", "orbit"), '\'motion.kind\' is "sway" there and "orbit" now'),
        (("--display", "looking-glass-portrait-sample-a"), "'display.name'"),
    ],
)
def test_other_settings_are_refused(
    arguments: tuple[object, ...], setting: str, made: Path, command: Command, display: Path
) -> None:
    given = ("animate", SCENE, "-o", made, "-d", display, *MOVING, "--frames", "0:3", "--resume")
    result = command(*given, *arguments)
    assert result.code == 8
    assert setting in result.error


@pytest.mark.needs("gl")
def test_a_scene_that_has_changed_is_refused(
    command: Command, scene: Path, display: Path, tmp_path: Path
) -> None:
    mine, out = tmp_path / "mine.gltf", tmp_path / "out"
    document = json.loads(scene.read_text())
    mine.write_text(json.dumps(document))
    given = ("animate", mine, "-o", out, "-d", display, *MOVING, "--frames", 0, "--processes", 1)
    assert command(*given).code == 0
    document["nodes"][0]["translation"] = [0, 0, 0.5]
    mine.write_text(json.dumps(document))
    result = command(*given, "--resume")
    assert result.code == 8
    assert "setting 'scene.digest'" in result.error


def test_one_run_a_folder(tmp_path: Path) -> None:
    folder = tmp_path / "frames"
    with FolderStore(folder, resume=False) as store:
        store.begin({"fps": 1.0})
        with pytest.raises(OutputError, match="another run writes here"):
            FolderStore(folder, resume=True).__enter__()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: is not the head"),
        ("{}\n", "line 1: is not the head"),
        ('{"schema": "other/1", "settings": {}}\n', "line 1: is not the head"),
        ('{"schema": "lfd-sequence/1", "settings": {}}\n[]\n', "line 2: '\\[\\]' tells of no"),
    ],
)
def test_damaged_manifests(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / MANIFEST).write_text(text)
    with pytest.raises(OutputError, match=message):
        FolderStore(tmp_path, resume=True).__enter__()


@contextmanager
def room_for(size: int) -> Iterator[None]:
    """No file may grow beyond a size, as on a disk that is full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)


def test_a_full_disk_keeps_what_was_finished(tmp_path: Path) -> None:
    folder = tmp_path / "frames"
    names = [f"frame_{n:06d}.png" for n in range(3)]
    with FolderStore(folder, resume=False) as store:
        store.begin({"fps": 1.0})
        store.put(names[0], b"x" * 4000)
        with room_for(5000), pytest.raises(OutputError, match=r"frame_000001.*finished are kept"):
            store.put(names[1], b"y" * 6000)
        with room_for((folder / MANIFEST).stat().st_size + 20), pytest.raises(OutputError):
            store.put(names[2], b"z")  # the manifest's line is cut off
    assert [path.name for path in frames(folder)] == names[:1]
    with FolderStore(folder, resume=True) as store:
        store.begin({"fps": 1.0})
        assert store.finished(names, lambda _: None).right == names[:1]
        store.put(names[2], b"z")
    with FolderStore(folder, resume=True) as store:
        assert store.finished(names, lambda _: None).right == [names[0], names[2]]
    assert not [path for path in folder.iterdir() if path.suffix == ".part"]


def test_a_frame_written_whole_is_taken_over(tmp_path: Path) -> None:
    folder, name = tmp_path / "frames", "frame_000000.png"
    with FolderStore(folder, resume=False) as store:
        store.begin({})
        store.put(name, b"whole")
        (sha256,) = Manifest.parse((folder / MANIFEST).read_text(), "").hashes.values()
    os.rename(folder / name, folder / f".{name}.{sha256}.part")
    with FolderStore(folder, resume=True) as store:
        store.begin({})
        assert store.finished([name], lambda _: None).right == [name]


def test_a_url_keeps_frames_too(tmp_path: Path) -> None:
    pytest.importorskip("fsspec")
    url = f"file://{tmp_path}/deep/frames"
    with UrlStore(url, resume=False) as store:
        store.begin({"fps": 1.0})
        for name in ("frame_000000.png", "frame_000001.png"):
            store.put(name, name.encode())
    with pytest.raises(OutputError, match="holds a sequence already"):
        UrlStore(url, resume=False).__enter__()
    (tmp_path / "deep/frames/frame_000001.png").write_bytes(b"other")
    with UrlStore(url, resume=True) as store:
        with pytest.raises(OutputError, match=r"'fps' is 1\.0 there and 2\.0 now"):
            store.check({"fps": 2.0})
        found = store.finished([f"frame_00000{n}.png" for n in range(3)], lambda _: None)
        assert (found.right, found.broken) == (["frame_000000.png"], ["frame_000001.png"])


def test_motions_come_round() -> None:
    still = Choices(yaw=10.0, dolly=1.0)
    assert Motion("orbit", period=8).at(still, 2).yaw == 100.0
    assert Motion("orbit", period=8).at(still, 8) == still
    assert Motion("sway", period=8, swing=20).at(still, 2).yaw == 30.0
    assert Motion("sway", period=8, swing=20).at(still, 6).yaw == -10.0
    assert Motion("dolly", period=8, travel=0.5).at(still, 2).dolly == 1.5
    with pytest.raises(OptionError, match="travel"):
        Motion("dolly", travel=-1.0)

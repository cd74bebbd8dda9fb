"""`lfd-render video`: what a lossless video decodes to, and what is refused."""

import resource
import signal
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render.engine.encoding import PNG, encoded
from lfd_render.engine.frame_store import FolderStore
from lfd_render.engine.manifest import MANIFEST
from lfd_render.panel import video
from lfd_render.panel.video import Encoding, read_video

from .conftest import Command

Pixels = NDArray[np.uint8]
SIZE = (17, 31)


def sequence(
    folder: Path, pictures: list[Pixels], first: int = 3, **settings: object
) -> list[Pixels]:
    """A folder as `animate` makes it."""
    with FolderStore(folder, resume=False) as store:
        store.begin({"picture": "eia", "format": "png", "fps": 24.0} | settings)
        for number, pixels in enumerate(pictures, first):
            store.put(f"frame_{number:06d}.png", encoded(pixels, PNG))
    return pictures


@pytest.fixture
def noise(tmp_path: Path, rng: np.random.Generator) -> list[Pixels]:
    """Five panel images of noise, in the folder ``frames``: any subsampling or loss would show."""
    pictures = rng.integers(0, 256, (5, *SIZE, 3), np.uint8)
    return sequence(tmp_path / "frames", list(pictures))


@pytest.mark.needs("video")
@pytest.mark.shows("a lossless video decodes to the exact pixels: FFV1, H.264, HEVC")
@pytest.mark.parametrize(
    ("name", "codec"),
    [("v.mkv", None), ("v.mp4", None), ("v.mkv", "h264"), ("v.mkv", "hevc"), ("v.mp4", "hevc")],
)
def test_lossless_videos_hold_all_pixels(
    name: str, codec: str | None, noise: list[Pixels], command: Command, tmp_path: Path
) -> None:
    out = tmp_path / name
    chosen = ("--codec", codec) if codec else ()
    result = command("video", tmp_path / "frames", "-o", out, "--json", *chosen)
    assert result.code == 0, result.stderr
    assert (result.json["frames"], result.json["fps"], result.json["lossless"]) == (5, 24.0, True)
    decoded = list(read_video(out))
    assert len(decoded) == 5
    assert all(np.array_equal(a, b) for a, b in zip(decoded, noise, strict=True))


@pytest.mark.needs("video")
def test_some_frames_only(noise: list[Pixels], command: Command, tmp_path: Path) -> None:
    out = tmp_path / "v.mkv"
    assert command("video", tmp_path / "frames", "-o", out, "--frames", "4:5").code == 0
    assert np.array_equal(np.stack(list(read_video(out))), np.stack(noise[1:3]))


@pytest.mark.needs("video")
def test_a_codec_that_changes_pixels_is_caught(
    noise: list[Pixels], command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Lossless as such, but 8-bit Y'CbCr does not hold all colours of RGB.
    planted = Encoding("libx264", "yuv444p", {"qp": "0"})
    monkeypatch.setitem(video.ENCODINGS, ("h264", "444"), planted)
    result = command("video", tmp_path / "frames", "-o", tmp_path / "v.mp4")
    assert result.code == 8
    assert "of 5 frames 5 decode, 5 to other pixels" in result.error
    assert not (tmp_path / "v.mp4").exists()


@pytest.mark.needs("video")
def test_quilts_may_halve_their_chroma(command: Command, tmp_path: Path) -> None:
    quilts = [np.full((48, 64, 3), (200, 30, 60), np.uint8)] * 3
    sequence(tmp_path / "frames", quilts, picture="quilt")
    out = tmp_path / "v.mp4"
    result = command("video", tmp_path / "frames", "-o", out, "--chroma", "420", "--json")
    assert result.code == 0, result.stderr
    assert (result.json["encoder"], result.json["lossless"]) == ("libx264", False)
    (decoded, *_) = read_video(out)
    # Y'CbCr's rounding leaves two levels; the matrix of another standard would leave tens.
    assert np.abs(decoded.astype(int) - quilts[0]).max() <= 3


@pytest.mark.needs("video")
@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("-o", "v.mp4", "--chroma", "420"), 2, "--chroma: 420 averages the colours of 2 x 2"),
        (("-o", "v.mp4", "--codec", "ffv1"), 2, "--codec: ffv1 goes into .mkv"),
        (("-o", "v.avi"), 2, "give .mkv or .mp4"),
        (("-o", "-"), 2, "a video goes to a file"),
        (("-o", "none/v.mkv"), 8, "no such folder"),
        (("-o", "v.mkv", "--frames", "3:9"), 2, "--frames: frame 8 is not in"),
    ],
)
def test_bad_requests(
    arguments: tuple[str, ...], code: int, message: str, noise: list[Pixels], command: Command,
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    result = command("video", "frames", *arguments)
    assert result.code == code
    assert message in result.error
    assert [path.name for path in tmp_path.iterdir()] == ["frames"]


@pytest.mark.needs("video")
def test_odd_quilts_keep_their_chroma(command: Command, tmp_path: Path) -> None:
    sequence(tmp_path / "frames", [np.zeros((*SIZE, 3), np.uint8)], picture="quilt")
    result = command("video", tmp_path / "frames", "-o", tmp_path / "v.mp4", "--chroma", "420")
    assert result.code == 2
    assert "420 takes even sizes, not 31 x 17" in result.error


@pytest.mark.needs("video")
def test_broken_sequences(noise: list[Pixels], command: Command, tmp_path: Path) -> None:
    folder = tmp_path / "frames"
    given = ("video", folder, "-o", tmp_path / "v.mkv")
    frame = folder / "frame_000005.png"
    whole = frame.read_bytes()
    frame.write_bytes(whole[:-40])
    result = command(*given)
    assert result.code == 7
    assert "frame_000005.png: is not what its manifest tells of" in result.error
    frame.unlink()
    result = command(*given)
    assert result.code == 7
    assert "frame_000005.png: cannot be read: No such file" in result.error
    lines = (folder / MANIFEST).read_text().splitlines(keepends=True)
    (folder / MANIFEST).write_text("".join(lines[:2] + lines[4:]))
    result = command(*given)
    assert result.code == 7
    assert "frame 4 and 1 more are missing between others" in result.error
    (folder / MANIFEST).unlink()
    result = command(*given)
    assert result.code == 7
    assert "manifest.jsonl: cannot be read: No such file" in result.error
    assert not (tmp_path / "v.mkv").exists()


@pytest.mark.needs("video")
def test_linear_frames_are_refused(command: Command, tmp_path: Path) -> None:
    sequence(tmp_path / "frames", [], format="exr")
    result = command("video", tmp_path / "frames", "-o", tmp_path / "v.mkv")
    assert result.code == 7
    assert "frames are exr; a video takes png" in result.error


@pytest.mark.needs("video")
def test_a_full_disk_leaves_no_video(noise: list[Pixels], command: Command, tmp_path: Path) -> None:
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4000, before[1]))
    try:
        result = command("video", tmp_path / "frames", "-o", tmp_path / "v.mkv")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    assert result.code == 8
    assert "v.mkv: " in result.error
    assert [path.name for path in tmp_path.iterdir()] == ["frames"]


def test_video_is_an_extra(
    noise: list[Pixels], command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    result = command("video", tmp_path / "frames", "-o", tmp_path / "v.mkv")
    assert result.code == 2
    assert "videos need PyAV; pip install 'lfd-render[video]'" in result.error

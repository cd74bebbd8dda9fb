"""Picture files: exact out and in, whole or absent, and clear about what is wrong."""

import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lfd_render.errors import OutputError, PictureError, UsageError
from lfd_render.panel import picture
from lfd_render.panel.picture import read_picture, read_png_text, write_png

PIXELS = np.random.default_rng(2).integers(0, 256, (13, 17, 3), dtype=np.uint8)


def test_png_round_trip_with_text(tmp_path: Path) -> None:
    path = tmp_path / "eia.png"
    text = {"display": "gavane-2024-tilted-4k", "note": "φ = 0, ½ lens"}
    write_png(path, PIXELS, text)
    assert (read_picture(path) == PIXELS).all()
    assert read_png_text(path) == text
    assert [p.name for p in tmp_path.iterdir()] == ["eia.png"]


def test_views_of_an_array_are_written_as_they_look(tmp_path: Path) -> None:
    path = tmp_path / "flipped.png"
    write_png(path, PIXELS[::-1, ::2])
    assert (read_picture(path) == PIXELS[::-1, ::2]).all()


def test_new_files_obey_the_umask(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        write_png(tmp_path / "a.png", PIXELS)
    finally:
        os.umask(before)
    assert (tmp_path / "a.png").stat().st_mode & 0o777 == 0o640


@pytest.mark.parametrize("kind", ["WEBP", "TIFF", "BMP"])
def test_other_lossless_kinds_are_read(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "picture"
    Image.fromarray(PIXELS).save(path, kind, **({"lossless": True} if kind == "WEBP" else {}))
    assert (read_picture(path) == PIXELS).all()
    assert read_png_text(path) == {}


def test_grey_palette_and_alpha_become_rgb(tmp_path: Path) -> None:
    path = tmp_path / "p.png"
    for mode in ("L", "P", "RGBA", "LA", "1"):
        Image.fromarray(PIXELS).convert(mode).save(path)
        assert read_picture(path).shape == (13, 17, 3)


def test_sixteen_bit_grey_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "deep.png"
    Image.fromarray(np.zeros((4, 4), np.uint16)).save(path)
    with pytest.raises(PictureError, match=r"deep\.png: has pixels of mode I"):
        read_picture(path)


def test_unreadable_pictures_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "bad.png"
    with pytest.raises(PictureError, match=r"bad\.png: cannot be read: No such file"):
        read_picture(path)
    with pytest.raises(PictureError, match="cannot be read: Is a directory"):
        read_picture(tmp_path)
    path.write_bytes(b"no picture at all")
    with pytest.raises(PictureError, match=r"bad\.png: is not a picture of a known kind"):
        read_picture(path)
    write_png(path, PIXELS)
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(PictureError, match=r"bad\.png: cannot be read"):
        read_picture(path)
    write_png(path, PIXELS)
    monkeypatch.setattr(picture, "MAX_PIXELS", 220)
    with pytest.raises(PictureError, match="has 17 x 13 pixels; at most 220"):
        read_picture(path)


def test_a_claimed_giant_is_refused_before_it_is_decoded(tmp_path: Path) -> None:
    path = tmp_path / "giant.png"
    write_png(path, PIXELS)
    data = bytearray(path.read_bytes())
    for side in (10_000, 60_000):
        data[16:24] = side.to_bytes(4, "big") * 2
        import zlib  # noqa: PLC0415

        data[29:33] = zlib.crc32(data[12:29]).to_bytes(4, "big")
        path.write_bytes(data)
        with pytest.raises(PictureError, match="at most 67108864"):
            read_picture(path)


def test_unwritable_places_are_named_and_left_clean(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"nowhere.*cannot be written: No such file"):
        write_png(tmp_path / "nowhere" / "a.png", PIXELS)
    (tmp_path / "folder").mkdir()
    with pytest.raises(OutputError, match="folder: cannot be written: Is a directory"):
        write_png(tmp_path / "folder", PIXELS)
    with pytest.raises(OutputError, match="cannot be written: embedded null"):
        write_png(f"{tmp_path}/a\0.png", PIXELS)
    assert [p.name for p in tmp_path.iterdir()] == ["folder"]


def test_a_failed_write_keeps_the_file_before_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.png"
    write_png(path, PIXELS)

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OutputError, match="No space left on device"):
        write_png(path, PIXELS[:4])
    assert (read_picture(path) == PIXELS).all()
    assert [p.name for p in tmp_path.iterdir()] == ["a.png"]


@pytest.mark.parametrize(
    "pixels",
    [PIXELS.astype(np.float32), PIXELS[..., 0], np.zeros((2, 2, 4), np.uint8), PIXELS[:0]],
)
def test_other_pixels_are_refused(tmp_path: Path, pixels: np.ndarray) -> None:
    with pytest.raises(UsageError, match=r"they should be uint8 \[y, x, 3\]"):
        write_png(tmp_path / "a.png", pixels)


def test_a_pipe_is_refused_at_once(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.png"
    os.mkfifo(pipe)
    with pytest.raises(PictureError, match="is a pipe"):
        read_picture(pipe)

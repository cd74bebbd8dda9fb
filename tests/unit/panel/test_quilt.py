"""Quilts: where each view lies, what files say of their tiling, and what is refused."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import ExifTags, Image

from lfd_render.display import DisplayProfile
from lfd_render.errors import PictureError, UsageError
from lfd_render.panel.picture import read_png_text, write_png
from lfd_render.panel.quilt import PRESETS, Quilt

RNG = np.random.default_rng(5)


def views_of(count: int, width: int = 4, height: int = 3) -> NDArray[np.uint8]:
    return RNG.integers(0, 256, (count, height, width, 3), dtype=np.uint8)


def test_view_0_is_at_the_bottom_left_and_rows_go_up() -> None:
    numbers = np.arange(6, dtype=np.uint8)[:, None, None, None]
    picture = Quilt(np.broadcast_to(numbers, (6, 2, 5, 3)).copy(), 3, 2).pixels
    assert picture.shape == (4, 15, 3)
    assert picture[::2, ::5, 0].tolist() == [[3, 4, 5], [0, 1, 2]]
    views = views_of(6)
    np.testing.assert_array_equal(Quilt(views, 3, 2).pixels[-3:, :4], views[0])  # top row first


@given(st.integers(1, 5), st.integers(1, 4), st.integers(1, 6), st.integers(1, 5), st.data())
def test_the_picture_gives_the_views_back(
    columns: int, rows: int, width: int, height: int, data: st.DataObject
) -> None:
    views = views_of(columns * rows, width, height)
    size = (
        columns * width + data.draw(st.integers(0, columns - 1)),
        rows * height + data.draw(st.integers(0, rows - 1)),
    )
    quilt = Quilt(views, columns, rows, size_px=size)
    assert quilt.pixels.shape == (size[1], size[0], 3)
    again = Quilt.from_pixels(quilt.pixels, columns, rows)
    np.testing.assert_array_equal(again.views, views)
    # What the tiles do not fill is on the right and on top.
    assert not quilt.pixels[: size[1] - rows * height].any()
    assert not quilt.pixels[:, columns * width :].any()


@pytest.mark.parametrize("name", PRESETS)
def test_presets_hold_their_tiles(name: str) -> None:
    size = PRESETS[name]
    width, height = size.view_px
    assert width * size.columns <= size.width_px < (width + 1) * size.columns
    assert height * size.rows <= size.height_px < (height + 1) * size.rows


def test_a_preset_that_tiles_do_not_fill_reads_back(tmp_path: Path) -> None:
    size = PRESETS["16-gen2"]
    flat = np.zeros((size.height_px, size.width_px, 3), np.uint8)
    flat[-1, 0] = 9
    quilt = Quilt.from_pixels(flat, size.columns, size.rows, 16 / 9)
    assert quilt.views[0, -1, 0, 0] == 9
    again = Quilt.load(quilt.save(tmp_path / "a"))
    assert (again.size_px, again.columns, again.rows) == (size[2:], size.columns, size.rows)
    np.testing.assert_array_equal(again.views, quilt.views)


def test_files_read_back_exactly(tmp_path: Path) -> None:
    aspect = 345.40 / 194.30
    quilt = Quilt(views_of(12), 4, 3, aspect, metadata={"lfd:seed": "7"})
    path = quilt.save(tmp_path / "helmet.png")
    assert path.name == "helmet_qs4x3a1.77766.png"
    again = Quilt.load(path)
    np.testing.assert_array_equal(again.views, quilt.views)
    assert (again.columns, again.rows, again.aspect) == (4, 3, aspect)  # to the last bit
    assert (again.metadata, again.warnings) == ({"lfd:seed": "7"}, ())


def test_the_metadata_is_what_other_programs_read(tmp_path: Path) -> None:
    path = Quilt(views_of(6), 3, 2, 0.75).save(tmp_path / "a")
    with Image.open(path) as image:
        comment = image.getexif().get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.UserComment]
    assert comment[:8] == b"ASCII\0\0\0"
    assert json.loads(comment[8:]) == {"LKGColumns": 3, "LKGRows": 2, "LKGAspect": 0.75}
    assert read_png_text(path)["lfd:quilt-tiles"] == "3x2"


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("a_qs3x2a0.75.png", "a_qs3x2a0.75.png"),
        ("a_QS3x2A0.75.PNG", "a_QS3x2A0.75.PNG"),
        ("a_qs3x2a0.7512.png", "a_qs3x2a0.7512.png"),  # rounded otherwise
        ("a.b", "a.b_qs3x2a0.75.png"),
        ("a_qs3x2", "a_qs3x2_qs3x2a0.75.png"),
    ],
)
def test_names_carry_the_tiling(tmp_path: Path, name: str, expected: str) -> None:
    assert Quilt(views_of(6), 3, 2, 0.75).save(tmp_path / name).name == expected


@pytest.mark.parametrize("name", ["a_qs2x3a0.75.png", "a_qs3x2a0.8.png"])
def test_a_name_of_another_tiling_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(UsageError, match=r"names .* views of aspect .*, but the quilt has 3 x 2"):
        Quilt(views_of(6), 3, 2, 0.75).save(tmp_path / name)


def commented(path: Path, comment: bytes, size: tuple[int, int] = (12, 6)) -> Path:
    """A picture with an EXIF UserComment, by Pillow."""
    exif = Image.Exif()
    exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.UserComment] = comment
    Image.fromarray(np.zeros((size[1], size[0], 3), np.uint8)).save(path, exif=exif.tobytes())
    return path


@pytest.mark.parametrize("suffix", ["png", "jpg", "webp"])
@pytest.mark.parametrize("charset", [b"ASCII\0\0\0", b"", b"UNICODE\0"])
def test_older_files_say_it_in_exif(tmp_path: Path, suffix: str, charset: bytes) -> None:
    text = json.dumps({"LKGColumns": 3, "LKGRows": "2", "LKGAspect": 0.7, "LKGOther": None})
    data = text.encode("utf-16-le") if charset.startswith(b"UNI") else text.encode()
    quilt = Quilt.load(commented(tmp_path / f"old.{suffix}", charset + data))
    assert (quilt.columns, quilt.rows, quilt.aspect, len(quilt.views)) == (3, 2, 0.7, 6)
    assert bool(quilt.warnings) == (suffix == "jpg")


@pytest.mark.parametrize(
    "comment",
    [
        b"", b"ASCII\0\0\0{", b"ASCII\0\0\0[]", b'ASCII\0\0\0{"LKGColumns": 3}',
        b'{"LKGColumns": 0, "LKGRows": 2}', b'{"LKGColumns": [], "LKGRows": 2}',
        b'{"LKGColumns": 1e999, "LKGRows": 2}', b"{" * 5000 + b"}", b"\xff" * 40,
    ],
)  # fmt: skip
def test_other_comments_say_nothing(tmp_path: Path, comment: bytes) -> None:
    with pytest.raises(PictureError, match="says nowhere how it is tiled; name it <stem>_qs"):
        Quilt.load(commented(tmp_path / "a.png", comment))
    assert Quilt.load(tmp_path / "a.png", (3, 2)).views.shape == (6, 3, 4, 3)


def test_a_name_that_disagrees_with_the_metadata_is_refused(tmp_path: Path) -> None:
    path = Quilt(views_of(12), 4, 3, 0.75).save(tmp_path / "a")
    other = path.rename(tmp_path / "a_qs3x4a0.75.png")
    expected = (
        r"its name says 3 x 4 views of aspect 0\.75, its metadata 4 x 3 views of aspect 0\.75"
    )
    with pytest.raises(PictureError, match=expected):
        Quilt.load(other)
    write_png(tmp_path / "b_qs3x2a0.75.png", np.zeros((6, 12, 3), np.uint8))
    commented(tmp_path / "b_qs3x2a0.75.png", b'{"LKGColumns": 2, "LKGRows": 3}')
    with pytest.raises(PictureError, match="its EXIF comment 2 x 3 views"):
        Quilt.load(tmp_path / "b_qs3x2a0.75.png")


@pytest.mark.parametrize(
    ("name", "size", "words"),
    [
        ("a_qs5x2a0.75.png", (12, 6), r"12 x 6 pixels do not divide into 5 x 2 views"),
        ("a_qs3x4a0.75.png", (12, 6), r"12 x 6 pixels do not divide into 3 x 4 views"),
        ("a_qs99x99a0.75.png", (12, 6), r"12 x 6 pixels cannot hold 99 x 99 views"),
        ("a_qs13x1a0.75.png", (12, 6), r"12 x 6 pixels cannot hold 13 x 1 views"),
        ("a_qs1x6a0.75.png", (12, 6), r"make views of 12 x 1, but its name says 1 x 6 views"),
        ("a_qs3x2.png", (12, 6), r"says nowhere how it is tiled"),
        ("a_qs0x2a1.png", (12, 6), r"says nowhere how it is tiled"),
    ],
)
def test_a_name_that_disagrees_with_the_pixels_is_refused(
    tmp_path: Path, name: str, size: tuple[int, int], words: str
) -> None:
    write_png(tmp_path / name, np.zeros((size[1], size[0], 3), np.uint8))
    with pytest.raises(PictureError, match=rf"{name}.*{words}"):
        Quilt.load(tmp_path / name)


def test_impossible_quilts_are_refused() -> None:
    with pytest.raises(UsageError, match="6 views do not fill 2 x 2 tiles"):
        Quilt(views_of(6), 2, 2)
    with pytest.raises(UsageError, match="views are float64"):
        Quilt(views_of(6).astype(float), 3, 2)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="aspect is -1"):
        Quilt(views_of(6), 3, 2, -1.0)
    with pytest.raises(UsageError, match="15 x 6 pixels do not hold 3 x 2 views of 4 x 3"):
        Quilt(views_of(6), 3, 2, size_px=(15, 6))


def test_views_of_another_aspect_are_told() -> None:
    portrait = DisplayProfile.load("looking-glass-portrait-sample-a")
    assert Quilt(views_of(6), 3, 2, 0.75).misfits(portrait) == []
    (told,) = Quilt(views_of(6), 3, 2, 1.77).misfits(portrait, "a.png")
    assert "aspect 1.77, the display 'looking-glass-portrait-sample-a' 0.75" in told

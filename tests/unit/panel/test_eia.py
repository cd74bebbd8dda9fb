"""Panel images as files: every format with its metadata, and what is said of files read."""

import json
import os
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

from lfd_render import __version__
from lfd_render.display import DisplayProfile, ViewGrid
from lfd_render.display.model import Panel
from lfd_render.errors import OutputError, PictureError
from lfd_render.panel.eia import Eia, eia_metadata, read_eia
from lfd_render.panel.picture import read_picture, read_png_text, write_png

DISPLAY = DisplayProfile.load("gavane-2024-tilted-4k").model_copy(
    update={"panel": Panel(resolution_px=(60, 24), size_mm=(60.0, 24.0))}
)


@pytest.fixture
def eia() -> Eia:
    rng = np.random.default_rng(7)
    pixels = rng.integers(0, 256, (24, 60, 3), dtype=np.uint8)
    linear = rng.uniform(0, 60000, pixels.shape).astype(np.float16)
    linear[0, 0] = (0.0, 6e-8, 65504.0)
    metadata = eia_metadata(
        DISPLAY, 9, ViewGrid.lens(DISPLAY, 6), technique="lfdpr", preset="paper", lod="area", seed=3
    )
    return Eia(pixels, linear, {}, metadata)


def test_metadata_says_how_the_picture_came_about(eia: Eia) -> None:
    columns = ViewGrid.lens(DISPLAY, 6).columns
    assert eia.metadata == {
        "Software": f"lfd_render {__version__}",
        "lfd:profile": "gavane-2024-tilted-4k",
        "lfd:profile-hash": DISPLAY.hash,
        "lfd:views": "9",
        "lfd:view-grid": "lens",
        "lfd:view-size": f"{columns}x6",
        "lfd:technique": "lfdpr",
        "lfd:preset": "paper",
        "lfd:lod": "area",
        "lfd:seed": "3",
    }


def test_png_holds_the_encoded_pixels(eia: Eia, tmp_path: Path) -> None:
    path = tmp_path / "eia.PNG"
    eia.save(path)
    np.testing.assert_array_equal(read_picture(path), eia.pixels)
    assert read_png_text(path) == eia.metadata


def test_exr_holds_the_linear_light(eia: Eia, tmp_path: Path) -> None:
    path = tmp_path / "eia.exr"
    eia.save(path)
    file = oiio.ImageInput.open(str(path))
    spec = file.spec()
    pixels = file.read_image("half")
    file.close()
    assert (spec.format.basetype, spec.channelnames) == (oiio.HALF, ("R", "G", "B"))
    np.testing.assert_array_equal(pixels.view(np.uint16), eia.linear.view(np.uint16))
    assert {key: spec.getattribute(key) for key in eia.metadata} == eia.metadata


def test_raw_holds_bytes_and_a_json_beside_it(eia: Eia, tmp_path: Path) -> None:
    eia.save(tmp_path / "eia.raw")
    found = json.loads((tmp_path / "eia.raw.json").read_text("utf-8"))
    assert found.pop("metadata") == eia.metadata
    assert found == {
        "schema": "lfd-raw/1", "width": 60, "height": 24,
        "channels": "rgb", "type": "uint8", "rows": "top first",
    }  # fmt: skip
    pixels = np.fromfile(tmp_path / "eia.raw", np.uint8).reshape(24, 60, 3)
    np.testing.assert_array_equal(pixels, eia.pixels)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["eia.raw", "eia.raw.json"]


def test_the_format_asked_for_wins_over_the_name(eia: Eia, tmp_path: Path) -> None:
    eia.save(tmp_path / "eia", "png")
    np.testing.assert_array_equal(read_picture(tmp_path / "eia"), eia.pixels)


def test_unknown_formats_are_named(eia: Eia, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"a\.tif: suffix '\.tif'.*ends in \.png, \.exr or \.raw"):
        eia.save(tmp_path / "a.tif")
    with pytest.raises(OutputError, match=r"a\.jpg: .*JPEG would mix the views"):
        eia.save(tmp_path / "a.jpg")
    with pytest.raises(OutputError, match=r"a\.png: format 'tif': unknown; use png, exr, raw"):
        eia.save(tmp_path / "a.png", "tif")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", ["png", "exr", "raw"])
def test_unwritable_places_are_left_clean(eia: Eia, tmp_path: Path, suffix: str) -> None:
    with pytest.raises(OutputError, match=rf"nowhere/a\.{suffix}.*: cannot be written: "):
        eia.save(tmp_path / "nowhere" / f"a.{suffix}")
    (tmp_path / f"b.{suffix}").mkdir()
    with pytest.raises(OutputError, match="cannot be written: Is a directory"):
        eia.save(tmp_path / f"b.{suffix}")
    assert {file.name for file in tmp_path.iterdir()} <= {f"b.{suffix}", "b.raw.json"}


@pytest.mark.parametrize("name", ["/dev/null", "pipe"])
def test_devices_and_pipes_are_never_replaced(eia: Eia, tmp_path: Path, name: str) -> None:
    path = tmp_path / name  # an absolute name stays as it is
    if name == "pipe":
        os.mkfifo(path)
    with pytest.raises(OutputError, match="is a device or a pipe"):
        eia.save(path, "png")
    assert not path.is_file()


def test_a_file_of_the_display_is_read_without_a_word(eia: Eia, tmp_path: Path) -> None:
    eia.save(tmp_path / "a.png")
    found = read_eia(tmp_path / "a.png", DISPLAY)
    np.testing.assert_array_equal(found.pixels, eia.pixels)
    assert (found.views, found.lens_rows, found.warnings) == (9, 6, ())


def test_other_figures_are_warned_of(eia: Eia, tmp_path: Path) -> None:
    eia.save(tmp_path / "a.png")
    other = DISPLAY.model_copy(update={"lens": DISPLAY.lens.model_copy(update={"center": 0.3})})
    (warning,) = read_eia(tmp_path / "a.png", other).warnings
    assert "made for gavane-2024-tilted-4k, whose figures differ" in warning


def test_a_jpeg_is_warned_of(eia: Eia, tmp_path: Path) -> None:
    Image.fromarray(eia.pixels).save(tmp_path / "a.jpg")
    found = read_eia(tmp_path / "a.jpg", DISPLAY)
    assert (found.views, found.lens_rows) == (None, None)
    (warning,) = found.warnings
    assert "chroma subsampling mixes the views" in warning


def test_another_size_is_an_error(eia: Eia, tmp_path: Path) -> None:
    write_png(tmp_path / "a.png", eia.pixels[:, :-1], eia.metadata)
    with pytest.raises(
        PictureError, match=r"a\.png: 59 x 24 pixels, made for gavane.*takes 60 x 24"
    ):
        read_eia(tmp_path / "a.png", DISPLAY)


@pytest.mark.parametrize(
    ("key", "value"),
    [("lfd:views", "many"), ("lfd:views", "0"), ("lfd:view-size", "x"), ("lfd:view-grid", "")],
)
def test_nonsense_metadata_is_passed_over(eia: Eia, tmp_path: Path, key: str, value: str) -> None:
    write_png(tmp_path / "a.png", eia.pixels, eia.metadata | {key: value})
    found = read_eia(tmp_path / "a.png", DISPLAY)
    assert (found.views is None) == (key == "lfd:views")
    assert (found.lens_rows is None) == (key != "lfd:views")

"""Quilts and unwoven views woven on the device: each subpixel's view, and its very code."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from lfd_render import Renderer, unweave
from lfd_render.display import DisplayProfile, Reconstruction, ViewGrid, shipped_profiles
from lfd_render.errors import UsageError
from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.panel import weaving
from lfd_render.panel.quilt import Quilt
from lfd_render.passes.encode import Encode
from lfd_render.passes.placement import Placement
from lfd_render.passes.view_target import ViewTarget
from lfd_render.reference.encode import srgb_from_linear
from lfd_render.reference.weave import woven
from lfd_render.renderer import camera_for
from lfd_render.scene import Scene
from lfd_render.techniques import Lfdpr

from .helpers import PAPER, few_lenses

pytestmark = pytest.mark.needs("gl")

Codes = NDArray[np.uint8]
VIEWS = 48


# ---- the published formula --------------------------------------------------------------------

# Calibrations as their sources print them: pitch, slope, center, DPI, screen.
LOOKING_GLASS = {
    "looking-glass-portrait-sample-a": (52.594, -7.2115, 0.40277, 324, (1536, 2048)),
    "looking-glass-portrait-sample-b": (52.563, -7.2447, 0.4017, 324, (1536, 2048)),
    "looking-glass-8_9-sample-a": (
        49.825218200683597, 5.2160325050354, -0.23396748304367066, 338, (2560, 1600)
    ),
    "looking-glass-8_9-sample-b": (
        47.56401443481445, -5.480000019073486, 0.374184787274007, 338, (2560, 1600)
    ),
    "looking-glass-8_9-sample-c": (49.91, 5.8, 0.0, 338, (2560, 1600)),
}  # fmt: skip


def published(name: str) -> tuple[float, float, float, tuple[int, int]]:
    """P, T, center and panel pixels, by no code of ours."""
    if name == PAPER:
        # 479.36 lenses at −9.66° over square pixels (Gavane and Watson 2024), to ten digits.
        drift = round(-2160 / 3840 * math.tan(math.radians(9.66)), 10)
        return 479.36, drift, 0.0, (3840, 2160)
    pitch, slope, center, dpi, (width, height) = LOOKING_GLASS[name]
    lens_count = pitch * (width / dpi) * math.cos(math.atan(1 / slope))
    return lens_count, height / (width * slope), center, (width, height)


def published_phase(
    name: str, rows: slice, half: float = 0.5, less: int = 0
) -> NDArray[np.float64]:
    """φ = (u + c/(3W) + v·T)·P − center of the subpixels of some rows, [y, x, channel].

    half and less are for known mistakes: u and v of a pixel's corner, and of W − 1 pixels.
    """
    lens_count, drift, center, (width, height) = published(name)
    u = (np.arange(width)[None, :, None] + half) / (width - less)
    v = (np.arange(height)[::-1][rows, None, None] + half) / (height - less)
    return (u + np.arange(3) / (3 * width) + v * drift) * lens_count - center


def numbered_quilt() -> Quilt:
    """View k filled with the code 5k + 3, in eight columns and six rows."""
    codes = (np.arange(VIEWS) * 5 + 3).astype(np.uint8)
    return Quilt(np.tile(codes[:, None, None, None], (1, 4, 5, 3)), 8, 6)


def wrong_views(eia: Codes, name: str, **mistake: float) -> tuple[int, int]:
    """Subpixels whose code names another view than the formula, and those on a boundary of two
    views, where rounding decides: 2⁻³² of a view in our tables, 2⁻⁴³ in float64."""
    wrong = borderline = 0
    for start in range(0, len(eia), 256):
        rows = slice(start, start + 256)
        phase = published_phase(name, rows, **mistake)  # type: ignore[arg-type]
        z = 1 - (phase - np.floor(phase))
        view = np.minimum(np.floor(z * VIEWS), VIEWS - 1)
        on_boundary = np.abs(z * VIEWS - np.rint(z * VIEWS)) < 2.0**-31
        wrong += np.count_nonzero((eia[rows] != 5 * view + 3) & ~on_boundary)
        borderline += np.count_nonzero(on_boundary)
    return wrong, borderline


@pytest.mark.shows("an EIA woven from a numbered-view quilt has the view that the formula names")
@pytest.mark.parametrize("name", shipped_profiles())
def test_numbered_quilts_land_where_the_published_formula_says(
    renderer: Renderer, tmp_path: Path, name: str
) -> None:
    quilt = Quilt.load(numbered_quilt().save(tmp_path / "numbered"))
    profile = DisplayProfile.load(name)
    eia = renderer.weave(quilt, profile).pixels
    assert eia.shape == (*published(name)[3][::-1], 3)
    wrong, borderline = wrong_views(eia, name)
    assert wrong == 0
    assert borderline < 1e-5 * eia.size


def test_known_wrong_formulas_and_wrong_quilts_are_caught(renderer: Renderer) -> None:
    name = "looking-glass-portrait-sample-b"
    profile = DisplayProfile.load(name)
    eia = renderer.weave(numbered_quilt(), profile).pixels
    assert wrong_views(eia, name, half=0.0)[0] > 0.5 * eia.size
    assert wrong_views(eia, name, less=1)[0] > 0.5 * eia.size
    # View 0 at the top left instead.
    upside_down = Quilt.from_pixels(numbered_quilt().pixels[::-1].copy(), 8, 6)
    assert wrong_views(renderer.weave(upside_down, profile).pixels, name)[0] > 0.5 * eia.size


# ---- very codes -------------------------------------------------------------------------------


@pytest.mark.shows("weave(quilt(views)) equals the direct weave of the same views, bit for bit")
def test_a_quilt_weaves_like_the_views_in_it(
    renderer: Renderer, rng: np.random.Generator, tmp_path: Path
) -> None:
    profile = few_lenses(PAPER, 37.7, (640, 420))
    views = rng.integers(0, 256, (12, 24, 41, 3), dtype=np.uint8)
    direct = renderer.weave(views, profile)
    quilt = Quilt.load(Quilt(views, 4, 3).save(tmp_path / "a"))
    from_quilt = renderer.weave(quilt, profile)
    np.testing.assert_array_equal(from_quilt.pixels, direct.pixels)
    np.testing.assert_array_equal(from_quilt.linear.view(np.uint16), direct.linear.view(np.uint16))
    # Planted fault: tiles that start at the top left.
    other = Quilt.from_pixels(quilt.pixels[::-1].copy(), 4, 3)
    assert (renderer.weave(other, profile).pixels != direct.pixels).mean() > 0.5


def test_a_quilt_of_a_scene_is_its_panel_image(renderer: Renderer) -> None:
    """As good as 8 bits and a tone curve before the mixing of columns let it be."""
    profile = few_lenses("looking-glass-portrait-sample-a", 61.7, (384, 512))
    scene = Scene.load("builtin:gallery?triangles=20000")
    options = {"views": 24, "view_size": (60, 80), "exposure": 0.2}
    direct = renderer.render(scene, profile, **options).pixels.astype(int)
    views = renderer.views(scene, profile, **options)
    apart = np.abs(renderer.weave(Quilt(views, 6, 4), profile).pixels - direct)
    # The edges of lamps, brighter than 0.8, are mixed before the curve in one and after it in the
    # other: 0.4 % of subpixels. The rest differs by the rounding of views to 8 bits.
    assert apart.mean() < 0.35
    assert (apart > 1).mean() < 0.01
    mirrored = renderer.weave(views[::-1].copy(), profile).pixels
    assert np.abs(mirrored - direct).mean() > 3  # control: views in reverse order


def linear_from_srgb(codes: Codes) -> NDArray[np.float64]:
    """IEC 61966-2-1."""
    light = codes / 255
    return np.where(light <= 0.04045, light / 12.92, ((light + 0.055) / 1.055) ** 2.4)


def test_columns_of_upright_views_mix_in_linear_light(
    renderer: Renderer, rng: np.random.Generator
) -> None:
    profile = few_lenses(PAPER, 37.7, (640, 420))
    views = rng.integers(0, 256, (5, 24, 41, 3), dtype=np.uint8)
    found = renderer.weave(views, profile).pixels
    expected = woven(linear_from_srgb(views), profile, ViewGrid.upright(profile, 41, 24))
    codes = np.rint(255 * srgb_from_linear(expected))
    # Half floats cut by a software device move a code by at most 0.1, sRGB decoded by one as much.
    assert np.abs(found - codes).max() <= 1
    assert (found != codes).mean() < 0.15
    mixed_codes = woven(views.astype(float), profile, ViewGrid.upright(profile, 41, 24))
    assert np.abs(found - np.rint(mixed_codes)).max() > 10  # control: mixing codes differs


RULES = (
    {"aa": "spatial"},
    {"aa": "angular"},
    {"aa": "both", "lookup": "subpixel"},
    {"weave": "linear"},
)


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: "-".join(rule.values()))
@pytest.mark.parametrize("light", ["linear", "encoded"])
def test_pictures_weave_through_every_filter(
    renderer: Renderer,
    rng: np.random.Generator,
    monkeypatch: pytest.MonkeyPatch,
    rule: dict[str, str],
    light: str,
) -> None:
    profile = few_lenses(PAPER, 37.7, (320, 210))
    views = rng.integers(0, 256, (5, 24, 41, 3), dtype=np.uint8)
    found = renderer.weave(views, profile, aa_light=light, **rule)
    grid = ViewGrid.upright(profile, 41, 24)
    given = linear_from_srgb(views) if light == "linear" else views.astype(float)
    expected = woven(given, profile, grid, Reconstruction(**rule))
    if light == "linear":
        expected = 255 * srgb_from_linear(expected)
    apart = np.abs(found.pixels - np.rint(expected))
    # Rounding as above; where single precision puts a sample into the next column, any amount.
    assert (apart > 1).mean() < 2e-4
    assert (apart > 0).mean() < 0.15
    plain = renderer.weave(views, profile).pixels.astype(float)
    assert np.abs(found.pixels - plain).mean() > 5  # control: the rule changes the picture
    assert (found.linear is None) == (light == "encoded")
    # In bands of five rows, with the rows around them that the filter reaches.
    rows = 5 + 2 * Reconstruction(**rule).halo
    monkeypatch.setattr(weaving, "BAND_BYTES", 4 * 5 * 41 * rows)
    banded = renderer.weave(views, profile, aa_light=light, **rule).pixels
    np.testing.assert_array_equal(banded, found.pixels)
    monkeypatch.setattr(Reconstruction, "halo", 0)  # planted fault
    if rule.get("aa") in ("spatial", "both"):
        bare = renderer.weave(views, profile, aa_light=light, **rule).pixels
        assert (bare != found.pixels).any()


@pytest.mark.parametrize("views", [1, 7])
def test_views_that_follow_the_lenses_keep_every_code(renderer: Renderer, views: int) -> None:
    profile = few_lenses(PAPER, 37.7, (640, 420))
    grid = ViewGrid.lens(profile, 420)
    count = views * grid.rows * grid.columns * 3
    pictures = (np.arange(count) % 256).astype(np.uint8).reshape(views, 420, grid.columns, 3)
    found = renderer.weave(pictures, profile, grid).pixels
    expected = woven(pictures.astype(float), profile, grid)
    np.testing.assert_array_equal(found, expected)
    assert len(np.unique(found)) == 256


@pytest.mark.shows("weave(unweave(E)) = E bit for bit")
@pytest.mark.parametrize("name", shipped_profiles())
def test_any_panel_image_weaves_back(
    renderer: Renderer, rng: np.random.Generator, full_counts: bool, name: str
) -> None:
    """Noise, which no views of fewer rows could hold."""
    profile = DisplayProfile.load(name)
    if not full_counts:
        profile = cropped(profile, 0.25)
    width, height = profile.resolution_px
    eia = rng.integers(0, 256, (height, width, 3), dtype=np.uint8)
    found = unweave(eia, profile)
    assert found.collisions == 0
    np.testing.assert_array_equal(renderer.weave(found, profile).pixels, eia)


def cropped(profile: DisplayProfile, part: float) -> DisplayProfile:
    """A part of the panel, with the same lenses over it."""
    width, height = (round(side * part) for side in profile.resolution_px)
    panel = profile.panel.model_copy(
        update={
            "resolution_px": (width, height),
            "size_mm": tuple(side * part for side in profile.size_mm),
        }
    )
    lens = profile.lens.model_copy(update={"lens_count": profile.lens_count * part})
    return profile.model_copy(update={"panel": panel, "lens": lens})


# ---- the views themselves ---------------------------------------------------------------------


def true_views(device: Device, scene: Scene, profile: DisplayProfile, grid: ViewGrid) -> Codes:
    """Views that follow the lenses, as they are woven, encoded: [view, row, column, 3]."""
    buffers = SceneBuffers(device, scene)
    rig = profile.rig()
    technique = Lfdpr(
        device, buffers, ViewTarget(device, rig, grid, buffers.batches), lod="anisotropic"
    )
    encode = Encode(device, grid.columns, technique.target.images.height)
    clock = StageClock(device)
    camera = camera_for(scene, profile).display_from_world(profile.size_mm)
    technique.begin(Placement(camera, (0.0, 0.0, 0.0)), clock)
    technique.warm_up(clock)
    views = np.empty((rig.views, grid.rows, grid.columns, 3), np.uint8)
    for band in technique.target.bands:
        technique.render(band, clock)
        for view in range(rig.views):
            encode(technique.target.images, view, 1.0)
            views[view, band.first : band.first + band.rows] = encode.read()[: band.rows]
    for owner in (technique, encode, buffers):
        owner.release()
    return views


@pytest.mark.shows("unweave is ≥ 40 dB against the true views on builtin:chart")
def test_unwoven_views_are_the_true_ones(
    device: Device,
    renderer: Renderer,
    scaled: Callable[[int, int], int],
    measured: Callable[[str, str], None],
) -> None:
    profile = DisplayProfile.load(PAPER)
    if scaled(1, 0) == 0:
        profile = cropped(profile, 0.5)
    scene = Scene.load("builtin:chart")
    rows = ViewGrid.default_rows(profile, profile.views)
    grid = ViewGrid.lens(profile, rows)
    eia = renderer.render(scene, profile)
    found = unweave(eia.pixels, profile)
    assert (found.collisions, found.grid.rows) == (0, rows)
    np.testing.assert_array_equal(renderer.weave(found, profile).pixels, eia.pixels)
    true = true_views(device, scene, profile, grid)

    def psnr(views: Codes) -> float:
        shift = grid.row_base - found.grid.row_base
        errors = [
            np.square(views[:, row, at : at + grid.columns].astype(float) - true[:, row]).mean()
            for row, at in enumerate(shift)
        ]
        return float(10 * np.log10(255**2 / np.mean(errors)))

    measured("unweave of the chart", f"{psnr(found.views):.1f} dB, at least 40")
    assert psnr(found.views) >= 40
    assert psnr(np.roll(found.views, 1, axis=0)) < 30  # control: the neighbouring view is not it


def test_arrays_that_are_no_views_are_named(renderer: Renderer) -> None:
    profile = few_lenses(PAPER, 37.7, (640, 420))
    grid = ViewGrid.lens(profile, 8)
    wanted = rf"they should be uint8 \[view, 8, {grid.columns}, 3\]"
    with pytest.raises(UsageError, match=rf"views are uint8 \[2, 8, 5, 3\]; {wanted}"):
        renderer.weave(np.zeros((2, 8, 5, 3), np.uint8), profile, grid)
    with pytest.raises(UsageError, match=r"views are float64"):
        renderer.weave(np.zeros((2, 8, 5, 3)), profile)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match=r"views: shape \[8, 5, 3\]"):
        renderer.weave(np.zeros((8, 5, 3), np.uint8), profile)
    with pytest.raises(UsageError, match="give a DisplayProfile"):
        renderer.weave(np.zeros((2, 8, 5, 3), np.uint8), PAPER)  # type: ignore[arg-type]

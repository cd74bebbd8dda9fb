"""The virtual panel shows each eye its own view, upright, in place, in the right colours."""

import math

import numpy as np
import pytest

from lfd_render.display import DisplayProfile, ViewGrid, shipped_profiles
from lfd_render.display.model import Cells, Panel
from lfd_render.errors import PictureError, ResourceError, UsageError
from lfd_render.panel.look import look, look_from, nearest_subpixels, seen_slot

VIEWS = 48
PAPER = DisplayProfile.load("gavane-2024-tilted-4k")


def view_angle(profile: DisplayProfile, view: int, views: int = VIEWS) -> float:
    """Angle at which the eye of a view stands."""
    return math.atan(float(profile.rig(views).eye_x_mm[view]) / profile.distance_mm)


def small(profile: DisplayProfile, mode: int | None = None) -> DisplayProfile:
    """The same lenses on 60 × 24 pixels, with stripes or a pattern of cells."""
    subpixels = profile.panel.subpixels
    if mode is not None:
        rng = np.random.default_rng(mode)
        offsets = tuple(
            tuple((float(x), float(y)) for x, y in cell)
            for cell in rng.uniform(-0.5, 0.5, (4, 3, 2))
        )
        subpixels = Cells(layout="cells", pattern_mode=mode, offsets_px=offsets)
    panel = Panel(resolution_px=(60, 24), size_mm=(60.0, 24.0), subpixels=subpixels)
    lens = profile.lens.model_copy(update={"lens_count": 9.3, "drift": 0.12, "center": 0.37})
    return profile.model_copy(update={"panel": panel, "lens": lens})


@pytest.mark.parametrize("name", shipped_profiles())
def test_each_eye_sees_its_view_everywhere(name: str) -> None:
    profile = DisplayProfile.load(name)
    # A grey level per view; the nearest subpixel is up to 0.9 view away, so a neighbour may show.
    levels = np.arange(VIEWS, dtype=np.uint8) * 5
    eia = levels[profile.view_index_map(VIEWS)]
    for view in (0, 17, 47):
        seen = look(eia, profile, view_angle(profile, view)).astype(int)
        assert np.abs(seen - 5 * view).max() <= 5
        assert abs(seen.mean() - 5 * view) < 2
    mirrored = look(eia, profile, -view_angle(profile, 17)).astype(int)
    assert np.abs(mirrored - 5 * (47 - 17)).max() <= 5  # control: the sign of the angle matters


def test_each_channel_follows_its_own_subpixels() -> None:
    palette = np.zeros((VIEWS, 3), np.uint8)
    palette[:16], palette[16:32], palette[32:] = (255, 40, 0), (0, 255, 40), (40, 0, 255)
    eia = palette[PAPER.view_index_map(VIEWS), np.arange(3)]
    for view in (8, 24, 40):
        seen = look(eia, PAPER, view_angle(PAPER, view))
        assert (seen == palette[view]).all()


def test_beyond_the_cone_the_views_repeat() -> None:
    levels = np.arange(VIEWS, dtype=np.uint8) * 5
    eia = levels[PAPER.view_index_map(VIEWS)]
    inner = math.tan(math.asin(math.sin(math.radians(20)) / 1.49))
    slot = (10.5 / VIEWS - 0.5) + 1  # view 10, one lens further
    angle = math.asin(1.49 * math.sin(math.atan(2 * slot * inner)))
    assert angle > math.radians(20)
    assert np.abs(look(eia, PAPER, angle).astype(int) - 50).max() <= 5


@pytest.mark.parametrize("mode", [None, 0, 1, 2, 3, 4])
@pytest.mark.parametrize("z", [0.01, 0.5, 0.73, 0.99])
def test_nearest_subpixels_are_those_of_a_full_search(mode: int | None, z: float) -> None:
    profile = small(PAPER, mode)
    grid = ViewGrid.lens(profile, 5)
    lens = grid.row_base[:, None] + np.arange(grid.columns)
    x, y, miss = nearest_subpixels(profile, grid, lens + (1 - z) % 1)
    phase = profile.phase_map()
    view_row = np.floor((np.arange(24) + 0.5) * 5 / 24).astype(int)
    for row, column, c in np.ndindex(miss.shape):
        lens = grid.row_base[row] + column
        inside = phase[view_row == row, :, c]
        inside = inside[np.floor(inside) == lens]
        wanted = lens + (1 - z) % 1
        nearest = np.abs(inside - wanted).min(initial=np.inf)
        # A cut off lens may hold only subpixels far from the place; those do not count.
        if nearest < profile.lens_count / 60:
            assert miss[row, column, c] == pytest.approx(nearest, abs=1e-12)
            at = phase[y[row, column, c], x[row, column, c], c]
            assert abs(at - wanted) == miss[row, column, c]
            assert view_row[y[row, column, c]] == row


def test_no_view_is_farther_than_stated_on_the_papers_display() -> None:
    grid = ViewGrid.lens(PAPER, 360)
    for z in (np.arange(0, 24, 5) + 0.5) / VIEWS:
        lens = grid.row_base[:, None] + np.arange(grid.columns)
        *_, miss = nearest_subpixels(PAPER, grid, lens + (1 - z) % 1)
        assert miss[:, 2:-2].max() * VIEWS < 0.54  # the outer lenses may be cut off


def test_the_picture_is_upright_and_in_place() -> None:
    # Linear light rising along the lenses to the right in red and upward in green.
    tables = PAPER.phase_tables()
    lens_centre = np.floor(tables.phase()) + 0.5
    v = 1 - (np.arange(2160)[:, None, None] + 0.5) / 2160
    u = (lens_centre + PAPER.center) / PAPER.lens_count - v * PAPER.drift
    light = np.where(np.arange(3) == 0, u, np.broadcast_to(v, u.shape)).clip(0, 1)
    code = np.where(light < 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    eia = np.rint(code * 255).astype(np.uint8)

    seen = look(eia, PAPER, math.radians(7)) / 255
    assert seen.shape == (360, 640, 3)
    linear = np.where(seen <= 0.04045, seen / 12.92, ((seen + 0.055) / 1.055) ** 2.4)
    expected_u = np.broadcast_to((np.arange(640) + 0.5) / 640, (360, 640))
    expected_v = np.broadcast_to(1 - (np.arange(360)[:, None] + 0.5) / 360, (360, 640))
    # Half a level of code is up to 0.0045 of light; a row of the view spans 1/360 in height.
    inner = np.s_[:, 4:-4]
    assert linear[inner][..., 0] == pytest.approx(expected_u[inner], abs=0.007)
    assert linear[inner][..., 1] == pytest.approx(expected_v[inner], abs=0.007)


@pytest.mark.parametrize("level", [0, 1, 10, 11, 128, 254, 255])
def test_a_plain_colour_stays_itself(level: int) -> None:
    profile = small(PAPER)
    eia = np.full((24, 60, 3), level, np.uint8)
    assert (look(eia, profile, 0.1, size_px=(31, 17)) == level).all()


def test_size_follows_the_views_or_the_request() -> None:
    profile = small(PAPER)
    eia = np.zeros((24, 60, 3), np.uint8)
    rows = ViewGrid.default_rows(profile, 8)
    assert look(eia, profile, 0.0, views=8).shape == (rows, round(rows * 2.5), 3)
    assert look(eia, profile, 0.0, size_px=(7, 9)).shape == (9, 7, 3)


def test_bad_requests_are_named() -> None:
    profile = small(PAPER)
    eia = np.zeros((24, 60, 3), np.uint8)
    with pytest.raises(
        PictureError, match=r"panel image is uint8 \[60, 24, 3\].*takes uint8 \[24,"
    ):
        look(eia.transpose(1, 0, 2), profile, 0.0)
    with pytest.raises(PictureError, match="panel image is float32"):
        look(eia.astype(np.float32), profile, 0.0)  # type: ignore[arg-type]
    for angle in (math.pi / 2, -3.0, math.nan):
        with pytest.raises(UsageError, match="angle is"):
            look(eia, profile, angle)
    with pytest.raises(UsageError, match="view size is 0 x 9"):
        look(eia, profile, 0.0, size_px=(0, 9))
    with pytest.raises(ResourceError, match="view size: 20000 x 9000 are more than"):
        look(eia, profile, 0.0, size_px=(20000, 9000))
    with pytest.raises(UsageError, match="views is 0"):
        look(eia, profile, 0.0, views=0)


# ---- eyes anywhere ----------------------------------------------------------------------------

ZERO = np.zeros(1)


def test_an_eye_on_the_line_of_eyes_is_an_angle() -> None:
    rng = np.random.default_rng(5)
    profile = small(PAPER)
    eia = rng.integers(0, 256, (24, 60, 3)).astype(np.uint8)
    eye = (profile.distance_mm * math.tan(0.1), 0.0, profile.distance_mm)
    np.testing.assert_array_equal(look_from(eia, profile, eye), look(eia, profile, 0.1))


@pytest.mark.parametrize("optics", ["rig", "slab"])
def test_small_shifts_follow_the_paraxial_formula(optics: str) -> None:
    """An eye shift s moves the phase by s·t/(n·D·p_h), displays.md's formula."""
    gap = 0.5 / math.tan(math.asin(math.sin(PAPER.cone_rad / 2) / PAPER.index))
    for distance in (600.0, 300.0, 1200.0):
        moved = seen_slot(PAPER, ZERO, ZERO, (0.5, 0.0, distance), optics)  # type: ignore[arg-type]
        assert moved[0] == pytest.approx(0.5 * gap / (PAPER.index * distance), rel=1e-5)


@pytest.mark.parametrize("optics", ["rig", "slab"])
def test_moving_along_the_lens_changes_nothing(optics: str) -> None:
    up = 3.0
    along = (-up * math.tan(PAPER.tilt_rad), up, 600.0)
    still = seen_slot(PAPER, ZERO, ZERO, along, optics)  # type: ignore[arg-type]
    assert still[0] == pytest.approx(0.0, abs=1e-12)
    raised = seen_slot(PAPER, ZERO, ZERO, (0.0, up, 600.0), optics)  # type: ignore[arg-type]
    assert abs(raised[0]) > 1e-3


def test_optics_agree_at_the_middle_and_differ_at_the_ends_of_the_panel() -> None:
    eye = (150.0, 0.0, 600.0)
    x = np.array([0.0, -170.0, 170.0])
    rig, slab = (seen_slot(PAPER, x, np.zeros(3), eye, optics) for optics in ("rig", "slab"))
    assert slab[0] == pytest.approx(rig[0], abs=1e-12)
    # Snell's law is not linear: of 48 views 1.9 off at the far end, 0.1 at the end before the eye.
    assert np.abs(slab - rig)[1:] * VIEWS == pytest.approx([1.85, 0.13], abs=0.01)


def test_a_nearer_eye_sees_other_views_across_the_panel() -> None:
    levels = np.arange(VIEWS, dtype=np.uint8) * 5
    eia = levels[PAPER.view_index_map(VIEWS)]
    seen = look_from(eia, PAPER, (0.0, 0.0, 450.0))[180].astype(float).mean(axis=-1) / 5
    # The lens at x sees as if from x·(1 − 600/450): the left end from the right.
    eyes = PAPER.rig(VIEWS).eye_x_mm
    x = ((np.arange(640) + 0.5) / 640 - 0.5) * 345.4
    wanted = np.interp(x * (1 - 600 / 450), eyes, np.arange(VIEWS))
    assert np.abs(seen - wanted)[5:-5].max() < 1.5
    assert np.abs(seen - wanted[::-1])[5:100].min() > 3  # control: the sign of the shift


def test_crosstalk_mixes_neighbouring_views_of_its_colour_alone() -> None:
    lit = np.where(np.arange(VIEWS) == 24, 255, 0).astype(np.uint8)
    eia = lit[PAPER.view_index_map(VIEWS)]
    at = {view: view_angle(PAPER, view) for view in (24, 26, 34)}

    def light(view: int, sigma: float | tuple[float, float, float]) -> np.ndarray:
        codes = look(eia, PAPER, at[view], sigma_views=sigma)[:, 20:-20] / 255
        linear = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
        return linear.mean(axis=(0, 1))

    sharp, blurred = light(26, 0.0), light(26, (2.0, 0.0, 2.0))
    assert sharp.max() < 0.05
    # Of a Gaussian of σ 2 the view two away has about its density times one view, 0.121.
    assert blurred[[0, 2]] == pytest.approx([0.121, 0.121], abs=0.02)
    assert blurred[1] == sharp[1]
    assert light(34, 2.0).max() < 0.01
    profile = PAPER.model_copy(
        update={"response": PAPER.response.model_copy(update={"sigma_views": (2.0, 0.0, 2.0)})}
    )
    by_profile = look(eia, profile, at[26])
    np.testing.assert_array_equal(by_profile, look(eia, PAPER, at[26], sigma_views=(2.0, 0.0, 2.0)))


def test_bad_eyes_are_named() -> None:
    profile = small(PAPER)
    eia = np.zeros((24, 60, 3), np.uint8)
    for z in (0.0, -600.0):
        with pytest.raises(UsageError, match="behind the panel"):
            look_from(eia, profile, (0.0, 0.0, z))
    with pytest.raises(UsageError, match="three finite numbers"):
        look_from(eia, profile, (math.nan, 0.0, 600.0))
    with pytest.raises(UsageError, match="crosstalk is -1"):
        look(eia, profile, 0.0, sigma_views=-1.0)
    with pytest.raises(UsageError, match="optics 'lens'"):
        look(eia, profile, 0.0, optics="lens")  # type: ignore[arg-type]

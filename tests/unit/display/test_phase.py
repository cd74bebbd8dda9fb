"""Every subpixel of every shipped unit belongs to the view that the published formula says."""

import math

import numpy as np
import pytest

from lfd_render.display import DisplayProfile, shipped_profiles, view_index
from lfd_render.display.model import Cells, Panel

VIEWS = 48

# pitch, slope, center, DPI, width, height: the vendor's own numbers of the sample units.
VENDOR = {
    "looking-glass-portrait-sample-a": (52.594, -7.2115, 0.40277, 324, 1536, 2048),
    "looking-glass-portrait-sample-b": (52.563, -7.2447, 0.4017, 324, 1536, 2048),
    "looking-glass-8_9-sample-a": (
        49.825218200683597, 5.2160325050354, -0.23396748304367066, 338, 2560, 1600,
    ),
    "looking-glass-8_9-sample-b": (
        47.56401443481445, -5.480000019073486, 0.374184787274007, 338, 2560, 1600,
    ),
    "looking-glass-8_9-sample-c": (49.91, 5.8, 0.0, 338, 2560, 1600),
}  # fmt: skip


def published_numbers(name: str) -> tuple[float, float, float, int, int]:
    """P, T, center, W, H from the sources' own figures, not from the profile files."""
    if name == "gavane-2024-tilted-4k":
        return 479.36, -0.0957457610, 0.0, 3840, 2160
    pitch, slope, center, dpi, width, height = VENDOR[name]
    count = pitch * (width / dpi) * math.cos(math.atan(1 / slope))
    return count, height / (width * slope), center, width, height


def views_by_formula(name: str, x: np.ndarray, y: np.ndarray, width_less: int = 0) -> np.ndarray:
    """View indices [y, x, channel] of the formula at pixel coordinates x and y from the bottom."""
    count, drift, center, width, height = published_numbers(name)
    u = (x / (width - width_less))[None, :, None]
    v = (y / height)[:, None, None]
    phase = (u + np.arange(3) / (3 * width) + v * drift) * count - center
    z = 1 - (phase - np.floor(phase))
    return np.minimum(np.floor(z * VIEWS), VIEWS - 1).astype(int)


def apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distance of two view indices, the shorter way round the cone."""
    difference = np.abs(a.astype(int) - b.astype(int))
    return np.minimum(difference, VIEWS - difference)


def test_all_samples_are_shipped() -> None:
    assert set(shipped_profiles()) == {"gavane-2024-tilted-4k", *VENDOR}


@pytest.mark.parametrize("name", ["gavane-2024-tilted-4k", *VENDOR])
def test_view_index_map_is_the_formula_on_every_subpixel(name: str) -> None:
    *_, width, height = published_numbers(name)
    expected = views_by_formula(name, np.arange(width) + 0.5, height - np.arange(height) - 0.5)
    got = DisplayProfile.load(name).view_index_map(VIEWS)
    assert got.dtype == np.uint16
    assert got.shape == (height, width, 3)
    assert np.count_nonzero(got != expected) == 0


def test_drift_of_the_paper_is_its_tilt() -> None:
    drift = DisplayProfile.load("gavane-2024-tilted-4k").drift
    assert drift == pytest.approx(2160 / 3840 * math.tan(math.radians(-9.66)), abs=5e-11)


@pytest.mark.parametrize("name", shipped_profiles())
def test_view_index_map_is_a_scalar_loop_of_the_formula(name: str) -> None:
    profile = DisplayProfile.load(name)
    width, height = profile.resolution_px
    views = profile.view_index_map(VIEWS)
    rng = np.random.default_rng(7)
    for _ in range(3000):
        x, y, c = int(rng.integers(width)), int(rng.integers(height)), int(rng.integers(3))
        u = (x + 0.5) / width
        v = (height - 1 - y + 0.5) / height
        phase = (u + c / (3 * width) + v * profile.drift) * profile.lens_count - profile.center
        z = 1.0 - (phase - math.floor(phase))
        assert views[y, x, c] == min(math.floor(z * VIEWS), VIEWS - 1)


def test_omitting_the_half_pixel_is_caught() -> None:
    name = "looking-glass-portrait-sample-a"
    *_, width, height = published_numbers(name)
    wrong = views_by_formula(name, np.arange(width), height - np.arange(height))
    off = apart(wrong, DisplayProfile.load(name).view_index_map(VIEWS))
    assert set(np.unique(off)) == {4, 5}


def test_dividing_by_one_pixel_less_is_caught() -> None:
    name = "looking-glass-portrait-sample-a"
    *_, width, height = published_numbers(name)
    y = height - np.arange(height) - 0.5
    wrong = views_by_formula(name, np.arange(width) + 0.5, y, width_less=1)
    off = apart(wrong, DisplayProfile.load(name).view_index_map(VIEWS))
    assert off[:, 0].max() <= 1
    assert 7.5 < off[:, -1].mean() < 7.9


def test_phase_map_is_the_sum_of_the_tables() -> None:
    profile = small_cells_profile(3)
    tables = profile.phase_tables()
    kinds = tables.kinds()
    phase = profile.phase_map()
    for y, x, c in np.ndindex(phase.shape):
        expected = tables.column[x, c] + tables.row[y] + tables.cell[kinds[y, x], c]
        assert phase[y, x, c] == expected
        assert tables.phase_at(np.array(x), np.array(y))[c] == expected


def small_cells_profile(mode: int) -> DisplayProfile:
    rng = np.random.default_rng(mode)
    offsets = tuple(
        tuple((float(x), float(y)) for x, y in rng.uniform(-0.5, 0.5, (3, 2)))
        for _ in range((1, 2, 2, 4, 2)[mode])
    )
    base = DisplayProfile.load("looking-glass-portrait-sample-a")
    cells = Cells(layout="cells", pattern_mode=mode, offsets_px=offsets)
    panel = Panel(resolution_px=(18, 13), size_mm=(18.0, 13.0), subpixels=cells)
    lens = base.lens.model_copy(update={"lens_count": 3.7})
    return base.model_copy(update={"panel": panel, "lens": lens})


@pytest.mark.parametrize("mode", range(5))
def test_cells_follow_their_pattern(mode: int) -> None:
    profile = small_cells_profile(mode)
    width, height = profile.resolution_px
    cells = profile.panel.subpixels
    assert isinstance(cells, Cells)
    phase = profile.phase_map()
    for row, x, c in np.ndindex(height, width, 3):
        y = height - 1 - row
        kind = [
            0,
            0 if x % 2 == y % 2 else 1,
            x % 2,
            (y + 2 * (x % 2)) % 4,
            y % 2,
        ][mode]
        right, up = cells.offsets_px[kind][c]
        u, v = (x + 0.5) / width, (y + 0.5) / height
        expected = u + right / width + (v + up / height) * profile.drift
        expected = expected * profile.lens_count - profile.center
        assert phase[row, x, c] == pytest.approx(expected, abs=1e-12)


def test_stripe_orders_and_origins_shift_the_colours() -> None:
    base = DisplayProfile.load("looking-glass-portrait-sample-a")
    step = base.lens_count / base.resolution_px[0] / 3

    def shifts(order: str, origin: str) -> np.ndarray:
        subpixels = base.panel.subpixels.model_copy(
            update={"order": order, "origin": f"{origin}-at-pixel-centre"}
        )
        panel = base.panel.model_copy(update={"subpixels": subpixels})
        column = base.model_copy(update={"panel": panel}).phase_tables().column
        return np.rint((column[0] - base.phase_tables().column[0, 0]) / step)

    assert shifts("rgb", "red").tolist() == [0, 1, 2]
    assert shifts("rgb", "green").tolist() == [-1, 0, 1]
    assert shifts("bgr", "red").tolist() == [0, -1, -2]
    assert shifts("bgr", "blue").tolist() == [2, 1, 0]


def test_view_of_exact_phases() -> None:
    phase = np.array([0.0, -3.0, 0.999, 0.5, 1e-18, -1e-18, 0.25])
    # frac 0 means z = 1, clamped to the last view; −1e-18 rounds to frac 1, z = 0.
    assert view_index(phase, 4).tolist() == [3, 3, 0, 2, 3, 0, 3]

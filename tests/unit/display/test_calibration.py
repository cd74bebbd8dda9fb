"""Fitting a profile to simulated photographs, the truth hidden from the fit."""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from lfd_render.display import DisplayProfile
from lfd_render.display.calibration import (
    Corners,
    Fit,
    PhotoSet,
    find_corners,
    fit,
    given_corners,
)
from lfd_render.display.model import Cells, Stripes
from lfd_render.display.patterns import blank, phase_pattern, phase_steps
from lfd_render.errors import LfdError, PictureError, UsageError

from ...photographs import Camera, Panel, Photographer, wall

# 100 lenses: at the paper's 479 the same photograph tells count and tilt the better by five.
TRUTH = Panel((800, 450), (72.0, 40.5))
CAMERA = Camera((800, 520), ((72, 44), (740, 30), (725, 462), (58, 478)))


def guess_for(
    panel: Panel,
    distance_mm: float = 600.0,
    lenses: float = 0.0,
    tilt_deg: float = 0.0,
    center: float = 0.0,
    order: str = "rgb",
) -> DisplayProfile:
    """A profile that is off by so much."""
    count, _, true_center = panel.seen(distance_mm)
    width, height = panel.size_mm
    stripes = {"layout": "stripe", "order": order, "origin": "green-at-pixel-centre"}
    return DisplayProfile.model_validate(
        {
            "name": "guess",
            "panel": {
                "resolution_px": panel.resolution_px,
                "size_mm": panel.size_mm,
                "subpixels": stripes,
            },
            "lens": {
                "lens_count": count + lenses,
                "drift": height / width * math.tan(math.radians(panel.tilt_deg + tilt_deg)),
                "center": true_center % 1 + center,
                "index": panel.index,
            },
            "viewing": {"views": 48, "cone_deg": 40.0, "distance_mm": distance_mm},
        }
    )


photographer_of = functools.lru_cache(2)(Photographer)


def photo_set(
    panel: Panel,
    camera: Camera,
    guess: DisplayProfile,
    seed: int,
    colours: tuple[int, ...] = (1,),
    harmonics: tuple[int, ...] = (1, 3),
) -> PhotoSet:
    """Photographs of the patterns of a guess."""
    rng = np.random.default_rng(seed)
    photographer = photographer_of(panel, camera)
    shots = []
    for step in phase_steps(guess, colours=colours):
        if step.harmonic in harmonics:
            taken = photographer.photograph(phase_pattern(guess, step), rng)
            shots.append((step, step.name, lambda taken=taken: taken))
    white = photographer.photograph(blank(guess, 255), rng)
    return PhotoSet("set", shots, ("white", lambda: white), None, camera.position_mm[2])


@dataclass(frozen=True)
class Misses:
    """How far a fit is off the truth; `bars` in standard uncertainties."""

    lenses: float
    tilt_deg: float
    views: float
    bars: tuple[float, float, float]


def misses(found: Fit, panel: Panel) -> Misses:
    profile = found.profile
    count, drift, center = panel.seen(profile.distance_mm)
    off = (profile.center - center + 0.5) % 1 - 0.5
    lenses = profile.lens_count - count
    bars = (
        lenses / found.doubts["lens_count"],
        (profile.drift - drift) / found.doubts["drift"],
        off / found.doubts["center"],
    )
    return Misses(
        lenses, math.degrees(profile.tilt_rad) - panel.tilt_deg, off * profile.views, bars
    )


def random_case(rng: np.random.Generator) -> tuple[Panel, Camera, DisplayProfile]:
    """A panel, a camera in front of it at 30 dB, and a guess up to a lens and 0.1° off."""
    panel = replace(
        TRUTH,
        pitch_mm=rng.uniform(0.6, 0.8),
        tilt_deg=rng.choice((-1, 1)) * rng.uniform(5, 15),
        gap_mm=rng.uniform(1, 2),
        phase=rng.uniform(0, 1),
        sigma_lenses=rng.uniform(0.035, 0.07),
    )
    corners = tuple((x + rng.uniform(-25, 25), y + rng.uniform(-20, 20)) for x, y in CAMERA.corners)
    camera = replace(
        CAMERA,
        corners=tuple((min(max(x, 20.0), 780.0), min(max(y, 20.0), 500.0)) for x, y in corners),
        position_mm=(0.0, 0.0, rng.uniform(400, 900)),
        blur_px=rng.uniform(0.4, 1.2),
        exposure=rng.uniform(0.5, 0.62),
    )
    guess = guess_for(
        panel,
        camera.position_mm[2],
        rng.uniform(-1, 1),
        rng.uniform(-0.1, 0.1),
        rng.uniform(-0.5, 0.5),
    )
    return panel, camera, guess


@pytest.mark.shows("lens count, tilt, center and error bars of a fit to photographs")
def test_fits_are_as_exact_as_their_error_bars_say(
    scaled: Callable[[int, int], int],
    rng: np.random.Generator,
    measured: Callable[[str, str], None],
) -> None:
    trials = scaled(200, 10)
    found = []
    for trial in range(trials):
        panel, camera, guess = random_case(rng)
        result = fit([photo_set(panel, camera, guess, trial, harmonics=(1,))], guess)
        found.append(misses(result, panel))
    worst = [max(abs(getattr(m, name)) for m in found) for name in ("lenses", "tilt_deg", "views")]
    covered = (np.abs([m.bars for m in found]) <= 2).mean(axis=0)
    measured("worst miss", f"{worst[0]:.4f} lenses, {worst[1]:.4f}°, {worst[2]:.3f} views")
    measured("error bars of 2 u cover", ", ".join(f"{100 * c:.0f} %" for c in covered))
    assert worst[0] <= 0.01
    assert worst[1] <= 0.002
    assert worst[2] <= 0.05
    assert (covered >= 0.9).all()
    # The bars are no wider than the misses need: a gate against bars that cover anything.
    assert (np.sqrt(np.mean(np.square([m.bars for m in found]), axis=0)) > 0.25).all()


@pytest.mark.parametrize(("lenses", "tilt_deg"), [(1, 0.1), (-1, -0.1), (1, -0.1), (-1, 0.1)])
def test_a_wrong_guess_converges(lenses: float, tilt_deg: float) -> None:
    guess = guess_for(TRUTH, 600.0, lenses, tilt_deg, 0.4)
    first = fit([photo_set(TRUTH, CAMERA, guess, 1, harmonics=(1,))], guess)
    miss = misses(first, TRUTH)
    assert abs(miss.lenses) < 0.005
    assert abs(miss.tilt_deg) < 0.002
    # The sign of the beat counts: the mirrored lattice is two lenses away.
    assert abs(first.report["fringes"][0] - lenses) < 0.01
    second = fit([photo_set(TRUTH, CAMERA, first.profile, 2, harmonics=(1,))], first.profile)
    miss = misses(second, TRUTH)
    assert abs(miss.lenses) < 0.001
    assert abs(miss.tilt_deg) < 0.0005
    assert abs(miss.views) < 0.02
    assert second.doubts["lens_count"] < first.doubts["lens_count"]


def test_colours_and_crosstalk_are_measured() -> None:
    panel = replace(Panel(), sigma_lenses=0.05)
    guess = guess_for(panel, lenses=0.4, tilt_deg=0.03, order="bgr")
    found = fit([photo_set(panel, Camera(), guess, 3, (0, 1, 2))], guess)
    assert isinstance(found.profile.panel.subpixels, Stripes)
    assert found.profile.panel.subpixels.order == "rgb"  # the guess had it the other way
    for sigma in found.profile.response.sigma_views:
        assert sigma == pytest.approx(0.05 * 48, rel=0.02)  # 1 % seen; blur dims finer fringes
    assert abs(misses(found, panel).views) < 0.05
    odd = replace(panel, offsets_px=(-0.3, 0.02, 0.25))
    guess = guess_for(odd, lenses=0.2)
    found = fit([photo_set(odd, Camera(), guess, 4, (0, 1, 2), (1,))], guess)
    subpixels = found.profile.panel.subpixels
    assert isinstance(subpixels, Cells)
    across = np.array(subpixels.offsets_px)[0, :, 0]
    assert across - across[0] == pytest.approx([0, 0.32, 0.55], abs=0.01)


def test_two_distances_tell_the_gap() -> None:
    near = replace(CAMERA, position_mm=(0.0, 0.0, 450.0))
    far = replace(CAMERA, position_mm=(0.0, 0.0, 900.0))
    guess = guess_for(TRUTH, 600.0, 0.1, 0.01)
    sets = [photo_set(TRUTH, c, guess, s, harmonics=(1,)) for s, c in enumerate((near, far))]
    found = fit(sets, guess)
    gap, doubt = found.profile.lens.gap_mm, found.doubts["gap_mm"]
    assert gap is not None
    assert abs(gap - TRUTH.gap_mm) < min(3 * doubt, 0.03)
    assert found.profile.distance_mm == 600.0
    assert abs(misses(found, TRUTH).lenses) < 0.005
    assert abs(misses(found, TRUTH).views) < 0.05
    with pytest.raises(UsageError, match="at least a tenth apart"):
        fit([replace(one, distance_mm=600.0) for one in sets], guess)


def test_a_camera_beside_the_middle_is_allowed_for() -> None:
    camera = replace(CAMERA, position_mm=(40.0, 0.0, 600.0))
    cone_deg = math.degrees(2 * math.asin(1.49 * math.sin(math.atan(0.36 / 1.53 / math.cos(
        math.radians(TRUTH.tilt_deg)
    )))))  # fmt: skip
    guess = guess_for(TRUTH)
    guess = guess.model_copy(
        update={"viewing": guess.viewing.model_copy(update={"cone_deg": cone_deg})}
    )
    photos = photo_set(TRUTH, camera, guess, 5, harmonics=(1,))
    aside = fit([photos], guess)
    right = fit([replace(photos, offset_mm=(40.0, 0.0))], guess)
    assert abs(misses(aside, TRUTH).views) > 3
    assert abs(misses(right, TRUTH).views) < 0.1  # a paraxial camera, a refracting rig


def test_a_cameras_distortion_and_curve_are_borne() -> None:
    camera = replace(CAMERA, distortion=0.01, gamma=1.1)
    guess = guess_for(TRUTH, 600.0, 0.8, 0.05)
    first = fit([photo_set(TRUTH, camera, guess, 6, harmonics=(1,))], guess)
    found = fit([photo_set(TRUTH, camera, first.profile, 7, harmonics=(1,))], first.profile)
    miss = misses(found, TRUTH)
    assert abs(miss.lenses) < 0.002
    assert abs(miss.tilt_deg) < 0.001
    assert abs(miss.views) < 0.05


def test_a_bowed_sheet_is_corrected() -> None:
    panel = replace(Panel(), bow=0.04)  # 1.9 of 48 views at the sides
    guess = guess_for(panel, lenses=0.2)
    found = fit([photo_set(panel, Camera(), guess, 10, harmonics=(1,))], guess, correction=True)
    assert found.profile.correction is not None
    nodes = np.array(found.profile.correction.phase_lenses)
    bow = panel.bow * (np.linspace(-1, 1, nodes.shape[1]) ** 2 - 1 / 3)
    # A tenth of a view; a correction of the wrong sign would be off by four.
    assert np.abs(nodes - bow).max() * 48 < 0.2
    assert abs(misses(found, panel).views) < 0.1
    again = found.profile
    second = fit([photo_set(panel, Camera(), again, 11, harmonics=(1,))], again, correction=True)
    assert second.report["residual_rms_views"] < found.report["residual_rms_views"] / 10
    assert second.profile.correction is not None
    assert np.abs(np.array(second.profile.correction.phase_lenses) - bow).max() * 48 < 0.2


def test_corners_are_found_and_given_alike() -> None:
    guess = guess_for(TRUTH, lenses=0.5)
    photos = photo_set(TRUTH, CAMERA, guess, 8, harmonics=(1,))
    assert photos.white is not None
    # The last lens cut by an edge is dark if its axis is outside: an eighth of one on average.
    found = find_corners(photos.white[1](), "white").lit_by(100, 10).photo_from_panel()
    for (u, v), corner in zip(((0, 0), (1, 0), (1, 1), (0, 1)), CAMERA.corners, strict=True):
        x, y, w = found @ (u, v, 1)
        assert np.hypot(x / w - corner[0], y / w - corner[1]) < 0.6
    given = replace(photos, white=None, corners=given_corners(list(CAMERA.corners)))
    assert abs(misses(fit([given], guess), TRUTH).views) < 0.02


@pytest.fixture(scope="module")
def small() -> tuple[DisplayProfile, PhotoSet]:
    guess = guess_for(Panel(), lenses=0.3)
    return guess, photo_set(Panel(), Camera(), guess, 9, harmonics=(1,))


def test_what_does_not_determine_the_lenses_is_refused(
    small: tuple[DisplayProfile, PhotoSet], rng: np.random.Generator
) -> None:
    guess, photos = small
    corners = Corners(np.array(Camera().corners, np.float64), 0.5)

    def refused(changed: PhotoSet, why: str) -> None:
        with pytest.raises(PictureError, match=why):
            fit([changed], guess)

    far = guess_for(Panel(), lenses=15)
    too_fine = replace(photo_set(Panel(), Camera(), far, 9, harmonics=(1,)), name="far")
    with pytest.raises(PictureError, match="too fine to follow"):
        fit([too_fine], far)
    walls = [(step, name, lambda: wall((600, 400), rng)) for step, name, _ in photos.shots]
    blank_wall = replace(photos, shots=walls, white=("white", walls[0][2]))
    refused(blank_wall, "white: no bright panel on a darker ground")
    refused(replace(blank_wall, corners=corners), "do not determine the lenses: the light swings")
    refused(replace(photos, shots=photos.shots[:2]), "green has 2 steps, as green_0of4; three")
    refused(replace(photos, shots=[]), "0 photographs have names of steps")
    refused(replace(photos, white=None), "no photograph 'white'")
    same = photos.shots[0][2]
    refused(
        replace(photos, shots=[(s, n, same) for s, n, _ in photos.shots]), "the light swings by 0.0"
    )
    mixed = [(s, n, photos.shots[(i * 5 + 3) % 4][2]) for i, (s, n, _) in enumerate(photos.shots)]
    fit([replace(photos, shots=mixed)], guess)  # a shift of all steps is but another center
    noise = [
        (s, n, lambda: rng.integers(20, 200, (400, 600, 3)).astype(np.uint8))
        for s, n, _ in photos.shots
    ]
    refused(replace(photos, shots=noise, corners=corners), "do not determine the lenses")


def test_photographs_that_cannot_be_measured_are_refused(
    small: tuple[DisplayProfile, PhotoSet],
) -> None:
    guess, photos = small
    step, name, read = photos.shots[1]

    def refused(pixels: np.ndarray, why: str) -> None:
        shots = [photos.shots[0], (step, name, lambda: pixels), *photos.shots[2:]]
        with pytest.raises(PictureError, match=why):
            fit([replace(photos, shots=shots)], guess)

    refused(read()[:-1], r"green_1of4: has 600 x 399 pixels, the others of its set 600 x 400")
    refused(np.where(read() > 120, 255, read()).astype(np.uint8), r"green_1of4: \d+ % of the panel")
    refused(np.zeros_like(read()), "green_1of4: the panel is darker than code 24")


@pytest.mark.parametrize(
    ("corners", "why"),
    [
        ([(50, 50), (550, 50), (550, 350)], "give four points"),
        ([(550, 50), (50, 50), (550, 350), (50, 350)], "out of order"),
        ([(50, 350), (550, 350), (550, 50), (50, 50)], "out of order"),
        ([(550, 50), (550, 350), (50, 350), (50, 50)], "begin at another corner"),
        ([(50, 50), (300, 50), (550, 50), (50, 350)], "lie on a line"),
        ([(50, 50), (550, 50), (math.nan, 350), (50, 350)], "give four points"),
        ([(50, 50), (950, 50), (950, 350), (50, 350)], "outside the photograph of 600 x 400"),
    ],
)
def test_corners_of_no_panel_are_refused(corners: list[tuple[float, float]], why: str) -> None:
    with pytest.raises(UsageError, match=why):
        given_corners(corners, (600, 400))


def test_pictures_without_a_panel_are_refused() -> None:
    dark = np.full((300, 400, 3), 5, np.uint8)
    full = np.full((300, 400, 3), 200, np.uint8)
    edge = dark.copy()
    edge[50:250, :300] = 200
    for picture in (dark, full, edge, dark[:10]):
        with pytest.raises(LfdError, match=r"^p\.png: "):
            find_corners(picture, "p.png")

"""What a caller may choose about rendering, and what presets choose for them."""

import dataclasses

import pytest

from lfd_render.errors import UsageError
from lfd_render.passes.sampling import DEFAULT_SAMPLING, PAPER_SAMPLING
from lfd_render.renderer import RenderOptions
from lfd_render.renderer.options import choose


def test_presets_choose_the_sampling() -> None:
    assert RenderOptions().sampling == dataclasses.replace(DEFAULT_SAMPLING, shade="auto")
    assert RenderOptions(preset="gold").sampling == DEFAULT_SAMPLING
    assert RenderOptions(preset="paper").sampling == PAPER_SAMPLING


def test_the_papers_preset_differs_from_ours_in_all_but_what_both_have() -> None:
    ours, paper = dataclasses.asdict(DEFAULT_SAMPLING), dataclasses.asdict(PAPER_SAMPLING)
    assert {name for name in ours if ours[name] == paper[name]} == {"density", "texture_limit"}


@pytest.mark.parametrize(
    ("options", "lattice", "source"),
    [
        ({"lattice": "paper"}, "paper", "compute"),
        ({"point_source": "raster"}, "paper", "raster"),
        ({"preset": "paper", "lattice": "rows"}, "rows", "compute"),
        ({"preset": "paper", "point_source": "compute"}, "paper", "compute"),
    ],
)
def test_what_is_not_chosen_follows_from_what_is(
    options: dict[str, str], lattice: str, source: str
) -> None:
    sampling = RenderOptions(**options).sampling
    assert (sampling.lattice, sampling.source) == (lattice, source)
    assert sampling.shade != "auto"  # which is the default preset's, on rows


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"lattice": "hexagons"}, "lattice 'hexagons': unknown; use rows or paper"),
        ({"point_source": "rays"}, "point source 'rays': unknown; use compute or raster"),
        ({"density": "high"}, "density 'high': unknown; use lfd or isotropic"),
        ({"culling": "all"}, "culling 'all': unknown; use exact or vertices"),
        ({"shade": "pixel"}, "shade 'pixel': unknown; use auto or ray or shared or point"),
        ({"lattice": "paper", "shade": "shared"}, "shade 'shared': what rows cut"),
        ({"lattice": "rows", "point_source": "raster"}, "rows are cut in compute"),
        ({"lattice": "paper", "projection": "general"}, "use it with lattice 'rows'"),
        ({"lattice": "paper", "splat": "owned"}, "use auto, two-pass or int64"),
        ({"lattice": "paper", "technique": "mvr"}, "lattice 'paper': technique 'mvr'"),
        ({"texture_limit": False, "technique": "mvr"}, "texture limit False: technique 'mvr'"),
    ],
)
def test_what_cannot_be_says_so(options: dict[str, object], message: str) -> None:
    with pytest.raises(UsageError, match=message.replace("?", r"\?")):
        RenderOptions(**options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"exposure": "1EV"}, "exposure: '1EV'; use a number"),
        ({"seed": -1}, "seed: -1; use 0 to 4294967295"),
        ({"seed": 2**40}, "seed: 1099511627776; use 0"),
        ({"repeat": 1.5}, "repeat: 1.5; use a whole number"),
        ({"background": "red"}, "background: 'red'; use three numbers"),
        ({"spacing": "even"}, "spacing: 'even'; use lens, angle"),
        ({"texture_limit": "no"}, "texture limit: 'no'; use True"),
        ({"environment_turn_rad": None}, "environment turn rad: None; use a number"),
    ],
)
def test_what_is_of_the_wrong_kind_says_so(options: dict[str, object], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        RenderOptions(**options)


def test_a_name_that_is_no_option_is_named() -> None:
    assert choose(3, {"seed": 5}) == RenderOptions(views=3, seed=5)
    with pytest.raises(UsageError, match="option 'sed': unknown; use view_size, technique"):
        choose(3, {"sed": 5})

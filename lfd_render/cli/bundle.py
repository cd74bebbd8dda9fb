"""Options of a picture as the one parameter `choices` of the commands that render."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from lfd_render.cli import options
from lfd_render.cli.console import warn
from lfd_render.engine.choices import Choices
from lfd_render.engine.texts import parse_exposure, parse_size, parse_supersample, parse_views

if TYPE_CHECKING:
    from lfd_render.display import Camera
    from lfd_render.scene import Environment

Command = Callable[..., None]

# Each option's annotation, for Typer, and default.
_OPTIONS: dict[str, tuple[Any, Any]] = {
    "views": (options.ViewsOption, None),
    "view_size": (options.ViewSizeOption, None),
    "technique": (options.TechniqueOption, options.Technique.LFDPR),
    "mvr": (options.MvrOption, "multipass"),
    "preset": (options.PresetOption, options.Preset.DEFAULT),
    "lookup": (options.LookupOption, options.Lookup.LENS),
    "weave": (options.WeavingOption, options.Weaving.NEAREST),
    "aa": (options.FilterOption, None),
    "aa_light": (options.FilterLightOption, options.FilterLight.LINEAR),
    "supersample": (options.SupersampleOption, "none"),
    "splat": (options.SplatOption, options.Splat.AUTO),
    "camera": (options.CameraOption, None),
    "focus_distance": (options.FocusDistanceOption, None),
    "yaw": (options.YawOption, 0.0),
    "pitch": (options.PitchOption, 0.0),
    "depth_scale": (options.DepthScaleOption, 1.0),
    "dolly": (options.DollyOption, 0.0),
    "spacing": (options.SpacingOption, None),
    "environment": (options.EnvironmentOption, "studio"),
    "environment_turn": (options.EnvironmentTurnOption, 0.0),
    "environment_intensity": (options.EnvironmentIntensityOption, 1.0),
    "exposure": (options.ExposureOption, None),
    "lod": (options.LodOption, None),
    "lattice": (options.LatticeOption, None),
    "point_source": (options.PointSourceOption, None),
    "density": (options.DensityOption, None),
    "texture_limit": (options.TextureLimitOption, None),
    "culling": (options.CullingOption, None),
    "stochastic_culling": (options.StochasticCullingOption, None),
    "shade": (options.ShadeOption, None),
    "seed": (options.SeedOption, 0),
}
LIGHT = ("environment", "environment_turn", "environment_intensity", "exposure")
PANEL_IMAGE = tuple(_OPTIONS)
VIEWS = tuple(n for n in _OPTIONS if n not in ("lookup", "weave", "aa", "aa_light", "splat"))
QUILT = tuple(
    n for n in VIEWS if n not in ("views", "view_size", "supersample", "lattice", "point_source",
                                  "density", "texture_limit", "culling", "stochastic_culling",
                                  "shade")
)  # fmt: skip


def with_choices(*names: str) -> Callable[[Command], Command]:
    """A command whose parameter `choices` becomes these options of the command line."""

    def wrap(command: Command) -> Command:
        parameters: list[inspect.Parameter] = []
        for parameter in inspect.signature(command, eval_str=True).parameters.values():
            parameters += _expanded(names) if parameter.name == "choices" else [parameter]

        @functools.wraps(command)
        def parsed(**given: Any) -> None:
            chosen = {name: given.pop(name) for name in names}
            command(**given, choices=choices_of(chosen))

        del parsed.__wrapped__  # else Typer looks through to the command
        parsed.__annotations__ = {p.name: p.annotation for p in parameters}
        vars(parsed)["__signature__"] = inspect.Signature(parameters)
        return cast(Command, parsed)

    return wrap


def _expanded(names: tuple[str, ...]) -> list[inspect.Parameter]:
    return [
        inspect.Parameter(
            name, inspect.Parameter.KEYWORD_ONLY, annotation=_OPTIONS[name][0],
            default=_OPTIONS[name][1],
        )
        for name in names
    ]  # fmt: skip


def choices_of(given: dict[str, Any]) -> Choices:
    """The choices of a command line's options; reads the files of a camera and an environment."""
    chosen = {name: value.value if isinstance(value, Enum) else value
              for name, value in given.items()}  # fmt: skip
    parsers: dict[str, Callable[[Any], Any]] = {
        "views": parse_views,
        "view_size": functools.partial(parse_size, "view_size"),
        "supersample": parse_supersample,
        "exposure": parse_exposure,
        "camera": _camera,
        "environment": _environment,
    }
    return Choices(**{n: parsers[n](v) if n in parsers else v for n, v in chosen.items()})


def _camera(text: str | None) -> str | Camera | None:
    """The camera of a file; else the name of one of the scene's."""
    if text is None or not Path(text).is_file():
        return text
    from lfd_render.display import Camera  # noqa: PLC0415 (keeps --help quick)

    return Camera.load(text)


def _environment(text: str) -> str | Environment:
    """The picture of a file; else studio or none."""
    if text in ("studio", "none"):
        return text
    from lfd_render.scene import Environment  # noqa: PLC0415 (keeps --help quick)

    environment = Environment.load(text)
    for warning in environment.warnings:
        warn(warning)
    return environment

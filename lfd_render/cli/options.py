"""Options that several commands share, and what their texts mean."""

import re
from enum import StrEnum
from typing import Annotated

import typer

from lfd_render.errors import UsageError

DEFAULT_DISPLAY = "gavane-2024-tilted-4k"
MAX_SEED = 2**32 - 1


class Technique(StrEnum):
    """How views are rendered."""

    LFDPR = "lfdpr"
    MVR = "mvr"


class Preset(StrEnum):
    """Which choices a technique makes."""

    DEFAULT = "default"
    PAPER = "paper"


class Spacing(StrEnum):
    """Rule by which the eyes of the views stand."""

    LENS = "lens"
    ANGLE = "angle"
    TANGENT = "tangent"


def parse_view_size(text: str | None) -> tuple[int, int] | None:
    """Columns and rows of ``480x360``; None stays None. Raises UsageError."""
    if text is None:
        return None
    match = re.fullmatch(r"([1-9]\d{0,5})[x×]([1-9]\d{0,5})", text.strip().lower())
    if not match:
        raise UsageError(f"--view-size: '{text}'; give columns x rows, as 480x360")
    return int(match[1]), int(match[2])


def check_device(text: str) -> str:
    """The device as `Device.open` takes it. Raises UsageError."""
    if text not in ("auto", "gpu", "software") and not re.fullmatch(r"\d{1,3}", text):
        raise UsageError(f"--device: '{text}'; give auto, gpu, software or an EGL index")
    return text


SceneArgument = Annotated[
    str,
    typer.Argument(metavar="SCENE", help="A .gltf or .glb file, or builtin:NAME[?triangles=N]."),
]
DisplayOption = Annotated[
    str,
    typer.Option("--display", "-d", metavar="NAME|FILE", help="Display profile."),
]
ViewsOption = Annotated[
    int | None,
    typer.Option(min=1, help="Number of views; else the display's."),
]
ViewSizeOption = Annotated[
    str | None,
    typer.Option(metavar="WxH", help="Columns and rows of a view; else the display's."),
]
TechniqueOption = Annotated[Technique, typer.Option(help="Rendering technique.")]
PresetOption = Annotated[
    Preset,
    typer.Option(
        help="default: our best; paper: the paper's upright views and stochastic culling."
    ),
]
CameraOption = Annotated[
    str | None,
    typer.Option(
        metavar="FILE|NAME",
        help="Where the display's window stands: a camera file, or a camera of the scene.",
    ),
]
FocusDistanceOption = Annotated[
    float | None,
    typer.Option(
        metavar="LENGTH",
        help="With --camera NAME: from there to the window, in scene units; "
        "else to the scene's middle.",
    ),
]
YawOption = Annotated[
    float,
    typer.Option(
        metavar="DEG", help="Turn the scene about the window's up axis, its right side forward."
    ),
]
DepthScaleOption = Annotated[float, typer.Option(metavar="F", help="Scale depth about the window.")]
SpacingOption = Annotated[
    Spacing | None,
    typer.Option(help="Rule by which the eyes are spaced; else the display's."),
]
SeedOption = Annotated[int, typer.Option(min=0, max=MAX_SEED, help="Seed of all random choices.")]
DeviceOption = Annotated[
    str,
    typer.Option(
        metavar="auto|gpu|software|INDEX",
        help="OpenGL device; an index is that of 'lfd-render doctor'.",
    ),
]
JsonOption = Annotated[
    bool, typer.Option("--json", help="Print one JSON object to stdout.", show_default=False)
]

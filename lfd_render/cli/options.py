"""Options that several commands share."""

import re
from enum import StrEnum
from typing import Annotated

import typer

from lfd_render.errors import OptionError

DEFAULT_DISPLAY = "gavane-2024-tilted-4k"
MAX_SEED = 2**32 - 1


class Technique(StrEnum):
    """How views are rendered."""

    LFDPR = "lfdpr"
    EXACT = "exact"
    MVR = "mvr"


class Preset(StrEnum):
    """Which choices a technique makes."""

    DEFAULT = "default"
    PAPER = "paper"
    GOLD = "gold"


class Splat(StrEnum):
    """How the nearest point of a view pixel is found."""

    AUTO = "auto"
    INT64 = "int64"
    TWO_PASS = "two-pass"
    OWNED = "owned"


class Lod(StrEnum):
    """Rule by which textures are filtered."""

    NONE = "none"
    AREA = "area"
    LONG_AXIS = "long-axis"
    MULTIVIEW = "multiview"
    ANISOTROPIC = "anisotropic"


class Lattice(StrEnum):
    """Where points lie."""

    ROWS = "rows"
    PAPER = "paper"


class PointSource(StrEnum):
    """What makes points of the paper's lattice."""

    COMPUTE = "compute"
    RASTER = "raster"


class Density(StrEnum):
    """How dense points are along their two axes."""

    LFD = "lfd"
    ISOTROPIC = "isotropic"


class Culling(StrEnum):
    """Which triangles are thought to be seen."""

    EXACT = "exact"
    VERTICES = "vertices"


class ShadePlace(StrEnum):
    """Where a pixel is shaded."""

    AUTO = "auto"
    RAY = "ray"
    SHARED = "shared"
    POINT = "point"


class Lookup(StrEnum):
    """Where on the panel a subpixel's view is sampled."""

    LENS = "lens"
    SUBPIXEL = "subpixel"


class Weaving(StrEnum):
    """How many views a subpixel is made of."""

    NEAREST = "nearest"
    LINEAR = "linear"


class Filter(StrEnum):
    """What the reconstruction filter spreads over."""

    NONE = "none"
    SPATIAL = "spatial"
    ANGULAR = "angular"
    BOTH = "both"


class FilterLight(StrEnum):
    """What filters average."""

    LINEAR = "linear"
    ENCODED = "encoded"


class Format(StrEnum):
    """What kind of file a panel image becomes."""

    PNG = "png"
    EXR = "exr"
    RAW = "raw"


class Spacing(StrEnum):
    """Rule by which the eyes of the views stand."""

    LENS = "lens"
    ANGLE = "angle"
    TANGENT = "tangent"


def check_device(text: str) -> str:
    """The device as `Device.open` takes it. Raises OptionError."""
    if text not in ("auto", "gpu", "software") and not re.fullmatch(r"\d{1,3}", text):
        raise OptionError("device", f"'{text}'; give auto, gpu, software or an EGL index")
    return text


SceneArgument = Annotated[
    str,
    typer.Argument(metavar="SCENE", help="A .gltf or .glb file, or builtin:NAME[?triangles=N]."),
]
DisplayOption = Annotated[
    str,
    typer.Option(
        "--display",
        "-d",
        metavar="NAME|FILE|auto",
        help="Display profile; auto: of the drive that is mounted.",
    ),
]
ViewsOption = Annotated[
    str | None,
    typer.Option(
        metavar="N|continuous",
        help="Number of views, or an angle for each subpixel; else the display's.",
    ),
]
ViewSizeOption = Annotated[
    str | None,
    typer.Option(metavar="WxH", help="Columns and rows of a view; else the display's."),
]
TechniqueOption = Annotated[Technique, typer.Option(help="Rendering technique.")]
MvrOption = Annotated[
    str,
    typer.Option(
        metavar="VARIANT",
        help="Which multi-view rasterisation mvr is: multipass, instanced-4, loop-4, …, each also "
        "with -deferred (docs/mvr.md).",
    ),
]
PresetOption = Annotated[
    Preset,
    typer.Option(
        help="default: our best; paper: every choice as the paper has it; "
        "gold: the slow picture to measure others by, of 96 views as large as the panel."
    ),
]
SplatOption = Annotated[
    Splat,
    typer.Option(
        help="How lfdpr finds nearest points: 64-bit atomics, two passes of 32-bit ones, or none "
        "in rows that work groups own. The picture is the same."
    ),
]
LatticeOption = Annotated[
    Lattice | None,
    typer.Option(
        help="Points on the rows that all views share, or the paper's lattice in each triangle's "
        "plane; else as the preset has it. The picture is the same, unless shaded at points."
    ),
]
PointSourceOption = Annotated[
    PointSource | None,
    typer.Option(help="What makes points of the paper's lattice: compute, or its raster stages."),
]
DensityOption = Annotated[
    Density | None,
    typer.Option(help="Points as dense along each axis as it needs, or as the denser one needs."),
]
TextureLimitOption = Annotated[
    bool | None,
    typer.Option(
        "--texture-limit/--no-texture-limit",
        help="Larger points where texels are (equations 1-3).",
        show_default=False,
    ),
]
CullingOption = Annotated[
    Culling | None,
    typer.Option(help="Exact, or the paper's by vertices, which loses triangles."),
]
StochasticCullingOption = Annotated[
    bool | None,
    typer.Option(
        "--stochastic-culling/--no-stochastic-culling",
        help="Drop some triangles below a tenth of a pixel, which punches holes.",
        show_default=False,
    ),
]
ShadeOption = Annotated[
    ShadePlace | None,
    typer.Option(
        help="Where pixels are shaded: at their ray's hit, shared where views see a place alike, "
        "auto for the quicker of these, or at the point they show; else as the preset has it."
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
PitchOption = Annotated[
    float,
    typer.Option(
        metavar="DEG", help="Then turn it about the window's horizontal axis, its top forward."
    ),
]
DepthScaleOption = Annotated[float, typer.Option(metavar="F", help="Scale depth about the window.")]
DollyOption = Annotated[
    float,
    typer.Option(metavar="HEIGHTS", help="Move the window into the scene, in its heights."),
]
SpacingOption = Annotated[
    Spacing | None,
    typer.Option(help="Rule by which the eyes are spaced; else the display's."),
]
ExposureOption = Annotated[
    str | None,
    typer.Option(
        metavar="FACTOR|±EV",
        help="What radiance is multiplied by: a factor, as 0.5, or stops, as -1.5EV.",
    ),
]
EnvironmentOption = Annotated[
    str,
    typer.Option(
        metavar="studio|none|FILE",
        help="Light from all around: built in, none, or an equirectangular EXR, HDR, … picture.",
    ),
]
EnvironmentTurnOption = Annotated[
    float,
    typer.Option(metavar="DEG", help="Turn the environment about +y, left seen from above."),
]
EnvironmentIntensityOption = Annotated[
    float, typer.Option(metavar="F", help="Scale the environment's light.")
]
FormatOption = Annotated[
    Format | None,
    typer.Option(
        help="png: sRGB; exr: scene-linear half floats, before exposure; raw: sRGB bytes, row by "
        "row, beside a .json. Else by the file's name; png to stdout."
    ),
]
TilesOption = Annotated[
    str | None,
    typer.Option(metavar="CxR", help="Columns and rows of the quilt, as 8x6."),
]
LodOption = Annotated[
    Lod | None,
    typer.Option(help="How textures are filtered; else as the preset has it."),
]
LookupOption = Annotated[
    Lookup, typer.Option(help="Sample views at the subpixel's lens, or at the subpixel itself.")
]
WeavingOption = Annotated[
    Weaving, typer.Option(help="The nearest view, or linear between the nearest two.")
]
FilterOption = Annotated[
    Filter | None,
    typer.Option(
        "--aa", help="Gaussian filter over view pixels, views or both; else as the preset has it."
    ),
]
FilterLightOption = Annotated[
    FilterLight, typer.Option("--aa-light", help="Filter linear light, or encoded pixels.")
]
SupersampleOption = Annotated[
    str,
    typer.Option(
        metavar="none|spatial|angular|NxM",
        help="N × N pixels for one and M eyes a view; spatial is 2x1, angular 1x2.",
    ),
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

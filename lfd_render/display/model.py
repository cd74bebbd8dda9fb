"""What a profile file may say: the fields of the format `lfd-display/1`, one model a section.

Lengths are millimetres, angles degrees, offsets pixels, as their names say. `LensStatement`
accepts the other ways of saying drift and lens count; `resolve_lens` turns it into `Lens`,
the canonical numbers.
"""

import math
from typing import Annotated, Any, Literal

from pydantic import Field

from lfd_render.display.strict import StrictModel
from lfd_render.errors import ProfileError

SCHEMA: Literal["lfd-display/1"] = "lfd-display/1"
MAX_VIEWS = 4096
ASSUMED_INDEX = 1.49  # acrylic, where a source does not say
KINDS_OF_MODE = (1, 2, 2, 4, 2)  # cell kinds that each CellPatternMode tells apart
AGREEMENT_VIEWS = 0.5  # two ways of saying the same may differ by this much over the panel

Text = Annotated[str, Field(min_length=1, max_length=200)]
Pixels = Annotated[int, Field(ge=1, le=1 << 15)]
Millimetres = Annotated[float, Field(gt=0, le=1e5)]
LensCount = Annotated[float, Field(ge=1, le=1 << 15, description="Lenses across the panel, P.")]
Drift = Annotated[
    float, Field(ge=-10, le=10, description="Drift of a lens over the height, in widths, T.")
]
Center = Annotated[float, Field(ge=-1e6, le=1e6, description="Phase at the panel's origin.")]
Index = Annotated[float, Field(ge=1, le=4, description="Refractive index of the lens sheet.")]
Offset = Annotated[float, Field(ge=-2, le=2)]
Sigma = Annotated[float, Field(ge=0, le=MAX_VIEWS)]
Doubt = Annotated[float, Field(ge=0)]
OffsetXY = tuple[Offset, Offset]
CellOffsets = tuple[OffsetXY, OffsetXY, OffsetXY]
Spacing = Literal["lens", "angle", "tangent"]


class Stripes(StrictModel):
    """Three vertical stripes a pixel; `origin` is the one that the phase formula puts at +0."""

    layout: Literal["stripe"] = "stripe"
    order: Literal["rgb", "bgr"] = "rgb"
    origin: Literal["red-at-pixel-centre", "green-at-pixel-centre", "blue-at-pixel-centre"] = (
        "red-at-pixel-centre"
    )

    def offsets_px(self) -> tuple[float, float, float]:
        """Distance of R, G and B from the origin stripe, in pixels to the right."""
        origin = self.order.index(self.origin[0])
        red, green, blue = ((self.order.index(c) - origin) / 3 for c in "rgb")
        return red, green, blue


class Cells(StrictModel):
    """Subpixels at measured offsets: `offsets_px[kind][channel]` is (right, up) in pixels."""

    layout: Literal["cells"]
    pattern_mode: Annotated[int, Field(ge=0, le=4)]
    offsets_px: Annotated[tuple[CellOffsets, ...], Field(min_length=1, max_length=16)]


class Panel(StrictModel):
    """The flat screen."""

    resolution_px: tuple[Pixels, Pixels]
    size_mm: tuple[Millimetres, Millimetres]
    subpixels: Annotated[Stripes | Cells, Field(discriminator="layout")] = Stripes()


class Lens(StrictModel):
    """The lens sheet, in canonical numbers, as the eye sees it at the viewing distance."""

    lens_count: LensCount
    drift: Drift
    center: Center
    index: Index = ASSUMED_INDEX
    gap_mm: Millimetres | None = None


def _one_of_each(schema: dict[str, Any]) -> None:
    """Say in the JSON Schema what `resolve_lens` asks for."""
    schema["dependentRequired"] = {"pitch_mm": ["gap_mm"]}
    schema["allOf"] = [
        {"anyOf": [{"required": ["drift"]}, {"required": ["tilt_deg"]}]},
        {"anyOf": [{"required": ["lens_count"]}, {"required": ["pitch_mm"]}]},
    ]


class LensStatement(StrictModel, json_schema_extra=_one_of_each):
    """The lens sheet as a file may state it: drift or tilt, count or pitch with gap."""

    lens_count: LensCount | None = None
    pitch_mm: Annotated[
        Millimetres | None, Field(description="Lens pitch across the axis; needs gap_mm.")
    ] = None
    drift: Drift | None = None
    tilt_deg: Annotated[
        float | None,
        Field(gt=-85, lt=85, description="Tilt from vertical, positive leans left going up."),
    ] = None
    center: Center
    index: Index = ASSUMED_INDEX
    gap_mm: Millimetres | None = None


class Viewing(StrictModel):
    """How many views, spread over which angle, seen from where."""

    views: Annotated[int, Field(ge=1, le=MAX_VIEWS)]
    cone_deg: Annotated[float, Field(gt=0, lt=180)]
    distance_mm: Annotated[float, Field(gt=0, le=1e6)]
    spacing: Spacing = "lens"


class Response(StrictModel):
    """Angular response of a lens per colour: standard deviation in views, 0 for none."""

    kind: Literal["gaussian"] = "gaussian"
    sigma_views: tuple[Sigma, Sigma, Sigma] = (0.0, 0.0, 0.0)


class Provenance(StrictModel):
    """Where the numbers come from, and which of them are assumptions."""

    source: Annotated[str, Field(max_length=2000)] = ""
    template: bool = False
    assumed: tuple[Text, ...] = ()


class Uncertainty(StrictModel):
    """Standard uncertainty of measured fields, in each field's own unit."""

    lens_count: Doubt | None = None
    drift: Doubt | None = None
    center: Doubt | None = None
    index: Doubt | None = None
    gap_mm: Doubt | None = None
    cone_deg: Doubt | None = None
    distance_mm: Doubt | None = None


class ProfileFields(StrictModel):
    """Everything that a profile and a profile file have in common."""

    schema_: Annotated[Literal["lfd-display/1"], Field(alias="schema")]
    name: Text
    serial: Text | None = None
    date: Text | None = None
    panel: Panel
    viewing: Viewing
    response: Response = Response()
    provenance: Provenance = Provenance()
    uncertainty: Uncertainty | None = None


class ProfileFile(ProfileFields):
    """Calibration profile of a tilted-lenticular light-field display."""

    lens: LensStatement


def resolve_lens(file: ProfileFile, source: str) -> Lens:
    """Canonical lens numbers of a file.

    Formulas of the physical lens: T = (h/w)·tan α; p_h = p⊥/cos α; P = w/(p_h·(1 + t/(n·D))),
    the lattice as it is seen from the distance D. Raises ProfileError where a number is missing
    or where two ways of saying it differ by more than half a view over the panel.
    """
    lens = file.lens
    width_mm, height_mm = file.panel.size_mm
    drift = lens.drift
    if lens.tilt_deg is not None:
        tilted = height_mm / width_mm * math.tan(math.radians(lens.tilt_deg))
        drift = tilted if drift is None else drift
    if drift is None:
        raise ProfileError(f"{source}: lens.drift is missing; add lens.drift or lens.tilt_deg")

    lens_count = lens.lens_count
    if lens.pitch_mm is not None:
        if lens.gap_mm is None:
            raise ProfileError(
                f"{source}: lens.gap_mm is missing; lens.pitch_mm needs it to find the lens count "
                "that the eye sees"
            )
        period_mm = lens.pitch_mm * math.hypot(1.0, drift * width_mm / height_mm)  # p⊥/cos α
        seen_mm = period_mm * (1 + lens.gap_mm / (lens.index * file.viewing.distance_mm))
        pitched = width_mm / seen_mm
        lens_count = pitched if lens_count is None else lens_count
    if lens_count is None:
        raise ProfileError(
            f"{source}: lens.lens_count is missing; add it, or lens.pitch_mm with lens.gap_mm"
        )

    views = file.viewing.views
    if lens.tilt_deg is not None:
        apart = abs(tilted - drift) * lens_count * views
        _check_agreement(source, f"tilt_deg {lens.tilt_deg}", f"drift {drift}", apart)
    if lens.pitch_mm is not None:
        apart = abs(pitched - lens_count) * views
        _check_agreement(source, f"pitch_mm {lens.pitch_mm}", f"lens_count {lens_count}", apart)
    if not 1 <= lens_count <= file.panel.resolution_px[0]:
        raise ProfileError(
            f"{source}: lens.lens_count is {lens_count}; it should be at least 1 and at most "
            f"panel.resolution_px[0] ({file.panel.resolution_px[0]}), one lens a pixel"
        )
    return Lens(
        lens_count=lens_count, drift=drift, center=lens.center, index=lens.index, gap_mm=lens.gap_mm
    )


def _check_agreement(source: str, one: str, other: str, apart_views: float) -> None:
    if apart_views > AGREEMENT_VIEWS:
        raise ProfileError(
            f"{source}: lens.{one} and lens.{other} disagree by {apart_views:.3g} views over the "
            "panel; correct one or keep only the right one"
        )

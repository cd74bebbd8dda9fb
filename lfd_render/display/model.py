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
Correction = Annotated[float, Field(ge=-4, le=4)]
CorrectionRow = Annotated[tuple[Correction, ...], Field(min_length=2, max_length=128)]
FieldPath = Annotated[str, Field(pattern=r"^(panel|lens|viewing|response|correction)(\.\w+)*$")]
Date = Annotated[
    str,
    Field(
        pattern=r"^\d{4}-(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01])$",
        description="Day of the calibration, as 2024-02-29.",
    ),
]
OffsetXY = tuple[Offset, Offset]
CellOffsets = tuple[OffsetXY, OffsetXY, OffsetXY]
Spacing = Literal["lens", "angle", "tangent"]


class Stripes(StrictModel):
    """Three stripes a pixel; `origin` is the one that the phase formula puts at +0.

    `order` is read to the right, or upwards where the panel stands on its side (`axis`), as the
    viewer sees it.
    """

    layout: Literal["stripe"] = "stripe"
    order: Literal["rgb", "bgr"] = "rgb"
    axis: Literal["right", "up"] = "right"
    origin: Literal["red-at-pixel-centre", "green-at-pixel-centre", "blue-at-pixel-centre"] = (
        "red-at-pixel-centre"
    )

    def offsets_px(self) -> tuple[float, float, float]:
        """Distance of R, G and B from the origin stripe along `axis`, in pixels."""
        origin = self.order.index(self.origin[0])
        red, green, blue = ((self.order.index(c) - origin) / 3 for c in "rgb")
        return red, green, blue


class Cells(StrictModel):
    """Subpixels at measured offsets: `offsets_px[kind][channel]` is (right, up) in pixels."""

    layout: Literal["cells"]
    pattern_mode: Annotated[int, Field(ge=0, le=4)]
    offsets_px: Annotated[tuple[CellOffsets, ...], Field(min_length=1, max_length=16)]


class Mount(StrictModel):
    """How the picture that the panel takes lies, against what the viewer sees.

    What the viewer sees is flipped, then turned counter-clockwise, to become the panel's picture.
    """

    rotation_deg: Literal[0, 90, 180, 270] = 0
    flip_x: bool = False
    flip_y: bool = False


class Panel(StrictModel):
    """The flat screen, as the viewer sees it: width before height, x to the right."""

    resolution_px: tuple[Pixels, Pixels]
    size_mm: tuple[Millimetres, Millimetres]
    subpixels: Annotated[Stripes | Cells, Field(discriminator="layout")] = Stripes()
    mount: Mount | None = None


class Lens(StrictModel):
    """The lens sheet, in canonical numbers, as the eye sees it at the viewing distance."""

    lens_count: LensCount
    drift: Drift
    center: Center
    index: Index = ASSUMED_INDEX
    gap_mm: Millimetres | None = None


def _one_of_each(schema: dict[str, Any]) -> None:
    """Say in the JSON Schema what `resolve_lens` asks for."""
    schema["dependentRequired"] = {"pitch_mm": ["gap_mm"], "physical_lens_count": ["gap_mm"]}
    schema["allOf"] = [
        {"anyOf": [{"required": ["drift"]}, {"required": ["tilt_deg"]}]},
        {
            "anyOf": [
                {"required": [name]} for name in ("lens_count", "pitch_mm", "physical_lens_count")
            ]
        },
    ]


class LensStatement(StrictModel, json_schema_extra=_one_of_each):
    """The lens sheet as a file may state it: drift or tilt, count or pitch with gap."""

    lens_count: LensCount | None = None
    pitch_mm: Annotated[
        Millimetres | None, Field(description="Lens pitch across the axis; needs gap_mm.")
    ] = None
    physical_lens_count: Annotated[
        LensCount | None, Field(description="Lenses of the sheet itself; needs gap_mm.")
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
    inverted: Annotated[
        bool, Field(description="The views run the other way under a lens: z = frac φ.")
    ] = False


class Response(StrictModel):
    """Angular response of a lens per colour: standard deviation in views, 0 for none."""

    kind: Literal["gaussian"] = "gaussian"
    sigma_views: tuple[Sigma, Sigma, Sigma] = (0.0, 0.0, 0.0)


class PhaseCorrection(StrictModel):
    """What a panel's phase has over the formula, smooth over the panel.

    `phase_lenses` [row][column], top row first, stand at points spread evenly from corner to corner
    of the panel; between them it is bilinear, taken at pixel centres.
    """

    phase_lenses: Annotated[tuple[CorrectionRow, ...], Field(min_length=2, max_length=128)]


class FieldSource(StrictModel):
    """Where one field's value comes from."""

    field: FieldPath
    source: Text


class Provenance(StrictModel):
    """Where the numbers come from, and which of them are assumptions."""

    source: Annotated[str, Field(max_length=2000)] = ""
    template: bool = False
    assumed: tuple[Text, ...] = ()
    fields: tuple[FieldSource, ...] = ()


class Uncertainty(StrictModel):
    """Standard uncertainty of measured fields, in each field's own unit."""

    lens_count: Doubt | None = None
    drift: Doubt | None = None
    center: Doubt | None = None
    index: Doubt | None = None
    gap_mm: Doubt | None = None
    cone_deg: Doubt | None = None
    distance_mm: Doubt | None = None
    offsets_px: Doubt | None = None
    sigma_views: Doubt | None = None
    phase_lenses: Doubt | None = None


class ProfileFields(StrictModel):
    """Everything that a profile and a profile file have in common."""

    schema_: Annotated[Literal["lfd-display/1"], Field(alias="schema")]
    name: Text
    serial: Text | None = None
    date: Date | None = None
    panel: Panel
    viewing: Viewing
    response: Response = Response()
    correction: PhaseCorrection | None = None
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

    others = _other_counts(file, drift, source)
    lens_count = lens.lens_count
    if lens_count is None and others:
        lens_count = next(iter(others.values()))
    if lens_count is None:
        raise ProfileError(
            f"{source}: lens.lens_count is missing; add it, or lens.pitch_mm with lens.gap_mm"
        )

    views = file.viewing.views
    if lens.tilt_deg is not None:
        apart = abs(tilted - drift) * lens_count * views
        _check_agreement(source, f"tilt_deg {lens.tilt_deg}", f"drift {drift}", apart)
    for field, count in others.items():
        apart = abs(count - lens_count) * views
        stated = f"{field} {getattr(lens, field)}"
        _check_agreement(source, stated, f"lens_count {lens_count}", apart)
    if not 1 <= lens_count <= file.panel.resolution_px[0]:
        raise ProfileError(
            f"{source}: lens.lens_count is {lens_count}; it should be at least 1 and at most "
            f"panel.resolution_px[0] ({file.panel.resolution_px[0]}), one lens a pixel"
        )
    return Lens(
        lens_count=lens_count, drift=drift, center=lens.center, index=lens.index, gap_mm=lens.gap_mm
    )


def _other_counts(file: ProfileFile, drift: float, source: str) -> dict[str, float]:
    """Lens count that the eye sees, of each field that says it otherwise, by the field's name."""
    lens = file.lens
    width_mm, height_mm = file.panel.size_mm
    counts: dict[str, float] = {}
    for field in ("pitch_mm", "physical_lens_count"):
        if getattr(lens, field) is not None and lens.gap_mm is None:
            raise ProfileError(
                f"{source}: lens.gap_mm is missing; lens.{field} needs it to find the lens count "
                "that the eye sees"
            )
    if lens.gap_mm is None:
        return counts
    wider = 1 + lens.gap_mm / (lens.index * file.viewing.distance_mm)
    if lens.pitch_mm is not None:
        period_mm = lens.pitch_mm * math.hypot(1.0, drift * width_mm / height_mm)  # p⊥/cos α
        _check_unit(source, lens.pitch_mm, width_mm / period_mm, file.panel.resolution_px[0])
        counts["pitch_mm"] = width_mm / (period_mm * wider)
    if lens.physical_lens_count is not None:
        counts["physical_lens_count"] = lens.physical_lens_count / wider
    return counts


# What a pitch may have been meant in, in millimetres.
_UNITS_MM = {"metres": 1000.0, "centimetres": 10.0, "micrometres": 1e-3}


def _check_unit(source: str, pitch_mm: float, count: float, width_px: int) -> None:
    """Raise ProfileError for a pitch that makes no lens sheet, naming the unit it may be in."""
    if 1 <= count <= width_px:
        return
    meant = [
        f"in {unit} it would be {pitch_mm * factor:g} mm"
        for unit, factor in _UNITS_MM.items()
        if 8 <= count / factor <= width_px / 2
    ]
    raise ProfileError(
        f"{source}: lens.pitch_mm is {pitch_mm:g}, which makes {count:.6g} lenses across; "
        f"it should be in millimetres, from 1 lens to {width_px}, one a pixel"
        + "".join(f"; {text}" for text in meant[:1])
    )


def _check_agreement(source: str, one: str, other: str, apart_views: float) -> None:
    if apart_views > AGREEMENT_VIEWS:
        raise ProfileError(
            f"{source}: lens.{one} and lens.{other} disagree by {apart_views:.3g} views over the "
            "panel; correct one or keep only the right one"
        )

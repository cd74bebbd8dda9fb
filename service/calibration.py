"""Calibration by eye: test patterns, and profiles with one number adjusted."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from pydantic import ConfigDict, Field

from lfd_render.display import DisplayProfile
from lfd_render.display.calibration.by_eye import FIELDS, adjusted, finished
from lfd_render.display.patterns import PATTERNS
from lfd_render.engine.jobs import Job, Pattern
from lfd_render.engine.patterns import PATTERN_COLOURS, check_pattern
from lfd_render.engine.plans import check_picture
from lfd_render.engine.texts import parse_size
from lfd_render.errors import ProfileError
from lfd_render.panel.eyes import stands

from .answers import answer
from .displays import Name
from .fields import DisplayName, Fields, OneOf, Size
from .jobs import LATER
from .media import choose
from .orders import PICTURES
from .problems import ProblemError, responses
from .state import Shared, State

router = APIRouter(prefix="/v1", tags=["calibration"])

Kind = Annotated[str, OneOf(PATTERNS)]
Colour = Annotated[str, OneOf(PATTERN_COLOURS)]
Display = DisplayName | dict[str, Any]


class PatternFields(Fields):
    """A test pattern."""

    kind: Kind = Field("grating", description="Which; docs/calibration.md says what each shows.")
    view: int | None = Field(None, ge=0, le=1023, description="Of a grating: the one lit.")
    width: int | None = Field(None, ge=1, le=1024, description="Of a grating: views lit about it.")
    colour: Colour | None = Field(None, description="Of a grating: subpixels that are lit.")
    eye: Annotated[str, Field(max_length=100)] | None = Field(
        None, description="With through: x,y,z in mm; else at the viewing distance."
    )
    size: Size | None = Field(None, description="With through: width x height of the picture.")

    def job(self, media: str, display: DisplayProfile, through: DisplayProfile | None) -> Job:
        """The job. Raises OptionError."""
        eye = None if self.eye is None else stands(display, None, self.eye, None)[0].eye_mm
        pattern = Pattern(
            self.kind, self.view, self.width, self.colour, through, eye,
            parse_size("size", self.size),
        )  # fmt: skip
        check_pattern(display, pattern)
        return Job(pattern, media, None, display)


class PatternQuery(PatternFields):
    """Query of a pattern of a display that has a name."""

    through: DisplayName | None = Field(
        None, description="Show what an eye before this display sees of it."
    )


class PatternBody(PatternFields):
    """A pattern of a display that needs no name."""

    model_config = ConfigDict(strict=True)

    display: Display = Field(
        description="A display's name, or a profile as in docs/profiles.md.",
        examples=["gavane-2024-tilted-4k"],
    )
    through: Display | None = Field(
        None, description="Show what an eye before this display sees of it."
    )


class AdjustBody(Fields):
    """A profile and what becomes of its lenses, one number after the other."""

    model_config = ConfigDict(strict=True)

    display: Display = Field(
        description="A display's name, or a profile.", examples=["gavane-2024-tilted-4k"]
    )
    lens_count: float | None = Field(None, gt=0, le=1e6, examples=[479.4])
    tilt_deg: float | None = Field(None, gt=-85, lt=85, description="Positive leans left going up.")
    center: float | None = Field(None, ge=-1e6, le=1e6, description="Phase at the panel's origin.")
    name: DisplayName | None = Field(
        None, description="Calls the profile so, and no longer a template: it is this unit's."
    )


_PICTURE: dict[str, Any] = {
    "description": "The pattern.",
    "content": {media: {"schema": {"type": "string", "format": "binary"}} for media in PICTURES},
}
_RESPONSES: dict[int | str, dict[str, Any]] = {
    200: _PICTURE,
    202: LATER,
    304: {"description": "The client has it."},
    **responses(406, 504, 507),
}


async def _answer(
    request: Request,
    state: State,
    fields: PatternFields,
    display: Display,
    through: Display | None,
) -> Response:
    profile = state.displays.told(display)
    media = choose(request.headers.get("accept"), PICTURES)
    seen = None if through is None else state.displays.told(through)
    job = fields.job(media, profile, seen)
    check_picture(job, state.settings.max_picture_pixels)
    return await answer(request, state, job)


@router.get(
    "/displays/{name}/pattern", summary="A test pattern", response_class=Response,
    responses=_RESPONSES,
)  # fmt: skip
async def display_pattern(
    request: Request, name: Name, state: Shared, query: Annotated[PatternQuery, Query()]
) -> Response:
    """The panel's pixels, exact under its profile; or what an eye sees of them on another panel."""
    return await _answer(request, state, query, name, query.through)


@router.post(
    "/pattern", summary="A test pattern of any profile", response_class=Response,
    responses=_RESPONSES,
)  # fmt: skip
async def pattern(request: Request, body: PatternBody, state: Shared) -> Response:
    """A pattern, with its display spelt out."""
    return await _answer(request, state, body, body.display, body.through)


@router.post(
    "/adjust-display", summary="Adjust a profile by eye", response_class=Response,
    responses={
        200: {"content": {"application/json": {"schema": {"type": "object"}}}}, **responses()
    },
)  # fmt: skip
async def adjust_display(body: AdjustBody, state: Shared) -> Response:
    """The profile with other numbers; count and tilt keep the phase at the panel's middle."""
    profile = state.displays.told(body.display)
    for field in FIELDS:
        value = getattr(body, field)
        if value is not None:
            try:
                profile = adjusted(profile, field, value)
            except ProfileError as error:
                raise ProblemError(422, str(error), field) from error
    if body.name is not None:
        profile = finished(profile, body.name)
    return Response(profile.to_json(), media_type="application/json")

"""Displays: read, kept, converted, and the maps of their subpixels."""

from __future__ import annotations

import hashlib
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query, Request, Response
from fastapi import Path as PathParameter
from fastapi.concurrency import run_in_threadpool
from pydantic import ConfigDict, Field

from lfd_render.display import DisplayProfile
from lfd_render.display.convert import convert
from lfd_render.engine import encoding
from lfd_render.engine.choices import Choices
from lfd_render.engine.jobs import Job, ViewMap
from lfd_render.engine.plans import check_picture

from .answers import answer
from .display_store import is_shipped
from .fields import DisplayName, Fields
from .jobs import LATER
from .media import choose
from .problems import ProblemError, links, responses
from .responses import matches
from .state import Shared

router = APIRouter(prefix="/v1", tags=["displays"])

Name = Annotated[
    str,
    PathParameter(pattern=r"^[a-z0-9][a-z0-9._-]{0,63}$", examples=["gavane-2024-tilted-4k"]),
]
_MOST_MAP_VIEWS = 4096


class DisplaySummary(Fields):
    """A display in the list."""

    name: str = Field(examples=["gavane-2024-tilted-4k"])
    title: str = Field(description="What its profile calls it.")
    resolution_px: tuple[int, int]
    size_mm: tuple[float, float]
    views: int
    cone_deg: float
    distance_mm: float
    template: bool = Field(description="Whether the figures are a model's, not a unit's own.")
    shipped: bool = Field(description="Whether it comes with the program, and stays.")


class DisplayList(Fields):
    """All displays by name."""

    displays: list[DisplaySummary]


class ConvertBody(Fields):
    """A profile and the system in whose words it is wanted."""

    model_config = ConfigDict(strict=True)

    display: DisplayName | dict[str, Any] = Field(
        description="A display's name, or a profile in any of the formats that are read.",
        examples=["looking-glass-portrait-sample-a"],
    )
    to: Literal["profile", "looking-glass", "3d-global", "van-berkel", "leia", "physical"] = Field(
        description="The format.", examples=["van-berkel"]
    )


class Lost(Fields):
    """A field that the format cannot hold."""

    field: str
    was: Any
    became: Any


class Converted(Fields):
    """A profile in another format. text: the file; lost: what reading it gives otherwise."""

    text: str
    lost: list[Lost]


def _summary(name: str, profile: DisplayProfile) -> DisplaySummary:
    return DisplaySummary(
        name=name,
        title=profile.name,
        resolution_px=profile.resolution_px,
        size_mm=profile.size_mm,
        views=profile.views,
        cone_deg=profile.viewing.cone_deg,
        distance_mm=profile.distance_mm,
        template=profile.template,
        shipped=is_shipped(name),
    )


@router.get("/displays", summary="All displays", responses=responses())
async def list_displays(state: Shared) -> DisplayList:
    """Those shipped and those that were put, by name."""
    found = state.displays.all()
    return DisplayList(displays=[_summary(name, profile) for name, profile in found.items()])


_LINKS = links(
    {"name": "$request.path.name"},
    see="get_display_v1_displays__name__get",
    map="view_map_v1_displays__name__map_get",
    delete="delete_display_v1_displays__name__delete",
)
_PROFILE: dict[str, Any] = {"content": {"application/json": {"schema": {"type": "object"}}}}


@router.get(
    "/displays/{name}", summary="A display's profile", response_class=Response,
    responses={200: _PROFILE, 304: {"description": "The client has it."}, **responses()},
)  # fmt: skip
async def get_display(request: Request, name: Name, state: Shared) -> Response:
    """The profile file, as docs/profiles.md has it."""
    text = state.displays.get(name).to_json()
    tag = f'"{hashlib.sha256(text.encode()).hexdigest()[:32]}"'
    if matches(request.headers.get("if-none-match"), tag):
        return Response(status_code=304, headers={"ETag": tag})
    return Response(text, headers={"ETag": tag}, media_type="application/json")


@router.put(
    "/displays/{name}", summary="Keep a display", response_class=Response,
    responses={200: _PROFILE, 201: _PROFILE | {"links": _LINKS}, **responses(409, 415, 507)},
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {
                "application/json": {
                    "schema": {"type": "object"},
                    "examples": {"see": {"externalValue": "docs/profiles.md"}},
                }
            },
        }
    },
)  # fmt: skip
async def put_display(request: Request, name: Name, state: Shared) -> Response:
    """Keep a profile under a name. It may also be a file of another system that is read."""
    try:
        text = (await request.body()).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ProblemError(422, f"body: byte {error.start} is not UTF-8", "body") from None
    profile, new = await run_in_threadpool(state.displays.put, name, text)
    return Response(
        profile.to_json(), 201 if new else 200, {"Location": f"/v1/displays/{name}"},
        "application/json",
    )  # fmt: skip


@router.delete(
    "/displays/{name}", summary="Delete a display", status_code=204, responses=responses(409)
)
async def delete_display(name: Name, state: Shared) -> Response:
    """Forget a display; those shipped stay."""
    state.displays.delete(name)
    return Response(status_code=204)


@router.post("/convert-display", summary="Convert a profile", responses=responses())
async def convert_display(body: ConvertBody, state: Shared) -> Converted:
    """A profile in the words of another system, and what these cannot say."""
    display = state.displays.told(body.display)
    made = await run_in_threadpool(convert, display, body.to)
    lost = [Lost(field=part.field, was=part.was, became=part.became) for part in made.lost]
    return Converted(text=made.text, lost=lost)


class MapQuery(Fields):
    """Query of a view-index map."""

    views: int | None = Field(None, ge=1, le=_MOST_MAP_VIEWS, description="Else the display's.")


@router.get(
    "/displays/{name}/map", summary="Which view each subpixel shows", response_class=Response,
    responses={
        200: {
            "description": "The map, view 0 leftmost: 8 bits a subpixel, or uint16 for numpy.",
            "content": {
                media: {"schema": {"type": "string", "format": "binary"}}
                for media in (encoding.PNG, encoding.NPY)
            },
        },
        202: LATER,
        304: {"description": "The client has it."},
        **responses(406, 504),
    },
)  # fmt: skip
async def view_map(
    request: Request, name: Name, state: Shared, query: Annotated[MapQuery, Query()]
) -> Response:
    """A PNG of up to 256 views, or a numpy file of any number."""
    display = state.displays.get(name)
    many = (query.views or display.views) > 256
    media = choose(
        request.headers.get("accept"), [encoding.NPY] if many else [encoding.PNG, encoding.NPY]
    )
    job = Job(ViewMap(), media, None, display, Choices(views=query.views))
    check_picture(job, state.settings.max_picture_pixels)
    return await answer(request, state, job)

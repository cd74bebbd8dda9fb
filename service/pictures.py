"""Pictures of a scene: the panel image, what eyes see of it, views, quilts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, TypeVar

from fastapi import APIRouter, Query, Request, Response
from fastapi import Path as PathParameter

from .answers import answer
from .fields import (
    AnyBody,
    AnyQuery,
    EiaQuery,
    LookQuery,
    QuiltQuery,
    ViewQuery,
    ViewsQuery,
)
from .jobs import LATER, IdempotencyKey, Prefer, wants_later
from .orders import of_body, of_query
from .problems import responses
from .state import Shared, State

router = APIRouter(prefix="/v1", tags=["pictures"])

Handler = TypeVar("Handler", bound=Callable[..., Any])
SceneId = Annotated[
    str,
    PathParameter(
        max_length=100, description="Id of an uploaded scene, or builtin:NAME.",
        examples=["builtin:spheres"],
    ),
]  # fmt: skip
_BYTES = {"schema": {"type": "string", "format": "binary"}}
_HEADERS = {
    "ETag": {"schema": {"type": "string"}, "description": "Names the picture's bytes."},
    "Server-Timing": {"schema": {"type": "string"}, "description": "Milliseconds of the stages."},
    "LFD-Size": {"schema": {"type": "string"}, "description": "Width x height."},
}


def _told(*media: str) -> dict[str, Any]:
    """What OpenAPI says of a picture's answers."""
    return {
        "response_class": Response,
        "responses": {
            200: {
                "description": "The picture.",
                "content": dict.fromkeys(media, _BYTES),
                "headers": _HEADERS,
            },
            202: LATER,
            304: {"description": "The client has it."},
            **responses(406, 504, 507),
        },
    }


_PANEL = ("image/png", "image/webp", "image/x-exr", "application/octet-stream", "image/jpeg")
_PICTURE = ("image/png", "image/webp", "image/jpeg", "application/octet-stream")


async def _of_query(request: Request, state: State, scene: str, query: AnyQuery) -> Response:
    accept, later = request.headers.get("accept"), wants_later(request)
    with of_query(state, scene, query, accept, later=later) as job:
        return await answer(request, state, job)


def _get(path: str, summary: str, *media: str) -> Callable[[Handler], Handler]:
    """The decorator of a picture's GET and HEAD."""
    told = _told(*media)

    def both(handler: Handler) -> Handler:
        router.head(path, summary=f"{summary}, its headers alone", **told)(handler)
        router.get(path, summary=summary, **told)(handler)
        return handler

    return both


@_get("/scenes/{scene}/eia", "The panel image", *_PANEL)
async def eia(
    request: Request, state: Shared, scene: SceneId, query: Annotated[EiaQuery, Query()]
) -> Response:
    """The image that the display's panel takes: all views woven in, bit for bit what `lfd-render
    render` writes."""
    return await _of_query(request, state, scene, query)


@_get("/scenes/{scene}/look", "What an eye sees", *_PICTURE)
async def look(
    request: Request, state: Shared, scene: SceneId, query: Annotated[LookQuery, Query()]
) -> Response:
    """The virtual panel: what an eye before the display sees of its panel image."""
    return await _of_query(request, state, scene, query)


@_get("/scenes/{scene}/view", "One view", *_PICTURE)
async def view(
    request: Request, state: Shared, scene: SceneId, query: Annotated[ViewQuery, Query()]
) -> Response:
    """A single upright view, by its number or its angle."""
    return await _of_query(request, state, scene, query)


@_get("/scenes/{scene}/views", "All views", "application/zip")
async def views(
    request: Request, state: Shared, scene: SceneId, query: Annotated[ViewsQuery, Query()]
) -> Response:
    """All upright views, view_000.png leftmost."""
    return await _of_query(request, state, scene, query)


@_get("/scenes/{scene}/quilt", "The quilt", *_PICTURE)
async def quilt(
    request: Request, state: Shared, scene: SceneId, query: Annotated[QuiltQuery, Query()]
) -> Response:
    """All upright views in one picture, view 0 bottom-left, rows going up."""
    return await _of_query(request, state, scene, query)


@router.post(
    "/render", summary="A picture, with its display and camera spelt out",
    **_told(*_PANEL, "application/zip"),
)  # fmt: skip
async def render(
    request: Request,
    state: Shared,
    body: AnyBody,
    prefer: Prefer = None,
    idempotency_key: IdempotencyKey = None,
) -> Response:
    """Any of the pictures, of a display and from a camera that need no name."""
    accept, later = request.headers.get("accept"), wants_later(request)
    with of_body(state, body, accept, later=later) as job:
        return await answer(request, state, job)

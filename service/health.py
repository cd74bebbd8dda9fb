"""Whether the service lives, is ready, and how it does."""

from __future__ import annotations

from fastapi import APIRouter, Response
from pydantic import BaseModel

from lfd_render.version import __version__

from . import metrics
from .problems import responses
from .state import Shared

router = APIRouter(tags=["health"])


class Alive(BaseModel):
    """The server answers."""

    status: str = "ok"
    version: str = __version__


class Readiness(BaseModel):
    """Whether pictures can be made. renderers: OpenGL's name for what each ready process renders
    with."""

    ready: bool
    processes: int
    processes_ready: int
    renderers: list[str]
    software: bool
    queued: int
    running: int


@router.get("/livez", summary="Whether the server lives", responses=responses())
async def livez() -> Alive:
    """Answers at once, whatever is being rendered."""
    return Alive()


@router.get(
    "/readyz",
    summary="Whether pictures can be made",
    responses={**responses(), 503: {"model": Readiness, "description": "Not ready"}},
)
async def readyz(state: Shared, response: Response) -> Readiness:
    """Ready when at least one render process is; a software renderer is said to be one."""
    pool = state.pool
    ready = pool.accepting and not state.ending.is_set()
    if not ready:
        response.status_code = 503
    return Readiness(
        ready=ready,
        processes=pool.settings.processes,
        processes_ready=pool.ready,
        renderers=pool.renderers,
        software=pool.software,
        queued=pool.queued,
        running=pool.running,
    )


@router.get(
    "/metrics",
    summary="Figures for Prometheus",
    response_class=Response,
    responses={200: {"content": {"text/plain": {}}}, **responses()},
)
async def prometheus(state: Shared) -> Response:
    """Queue depth, times of stages, GL renderers, restarts, requests."""
    return Response(state.metrics.text(), media_type=metrics.MEDIA)

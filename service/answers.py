"""From a job to an HTTP answer: conditional, cached, and called off when its client goes."""

from __future__ import annotations

import re

from fastapi import Request, Response

from lfd_render.engine.jobs import Job, Result

from .clients import unless_gone
from .jobs import accepted, wants_later
from .picture import Picture
from .responses import ALWAYS, PiecesResponse, matches
from .state import State


async def answer(request: Request, state: State, job: Job) -> Response:
    """The job's picture, 304 where the client has it, 202 where it asks to be answered later."""
    name = state.pool.tag(job)
    headers = {"ETag": (tag := f'"{name}"'), **ALWAYS}
    if matches(request.headers.get("if-none-match"), tag):
        state.metrics.cached.labels("not modified").inc()
        return Response(status_code=304, headers=headers)
    if request.method == "HEAD":
        return _bare(headers | {"Content-Type": job.media})
    picture = state.answers.get(name)
    if picture is not None:
        state.metrics.cached.labels("answer").inc()
        headers["Server-Timing"] = 'cache;desc="hit"'
    elif wants_later(request):
        return await accepted(request, state, [job])
    else:
        result = await racing(request, state, job)
        request.scope["lfd.spans"] = result.timings_ms
        picture = Picture.of(job, result)
        state.answers.put(name, picture, len(picture.body))
        headers["Server-Timing"] = server_timing(result.timings_ms)
    return PiecesResponse(picture.body, headers=headers | picture.headers, media_type=job.media)


def _bare(headers: dict[str, str]) -> Response:
    """The answer to HEAD: no length is told, since none is known before the picture is made."""
    response = Response(headers=headers)
    del response.headers["content-length"]
    return response


async def racing(request: Request, state: State, job: Job) -> Result:
    """The job's result, or ClientGoneError as soon as the client goes."""
    work = state.pool.run(job, deadline_s=_patience_s(request, state.settings.deadline_s))
    result = await unless_gone(request.receive, work)
    state.metrics.observe(result.timings_ms)
    return result


def _patience_s(request: Request, most: float) -> float:
    """How long a request may take: as long as the server lets it, or the client would wait by
    ``Prefer: wait`` (RFC 7240, section 4.3)."""
    said = re.search(r"\bwait=(\d{1,6})\b", ",".join(request.headers.getlist("prefer")).lower())
    return min(most, float(said[1])) if said else most


def server_timing(timings_ms: dict[str, float]) -> str:
    """The value of a Server-Timing header."""
    return ", ".join(f"{name};dur={ms:g}" for name, ms in timings_ms.items())

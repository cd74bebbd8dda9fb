"""From a job to an HTTP answer: conditional, cached, and called off when its client goes."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from fastapi import Request, Response

from lfd_render.display import Camera, DisplayProfile
from lfd_render.engine import encoding
from lfd_render.engine.jobs import AllViews, Job, PanelImage, Result, SceneSource
from lfd_render.engine.plans import check_plan

from .fields import EiaFields, Views
from .media import choose
from .responses import PiecesResponse
from .state import Picture, State

_SUFFIXES = {
    encoding.PNG: "png", encoding.WEBP: "webp", encoding.JPEG: "jpg", encoding.EXR: "exr",
    encoding.RAW: "raw", encoding.ZIP: "zip", encoding.NPY: "npy",
}  # fmt: skip
PICTURES = (encoding.PNG, encoding.WEBP, encoding.JPEG, encoding.RAW)
PANEL = (encoding.PNG, encoding.WEBP, encoding.EXR, encoding.RAW)


class ClientGoneError(Exception):
    """Nobody waits for the answer."""


def offered(fields: Views) -> Sequence[str]:
    """Media types in which a picture is to be had."""
    if isinstance(fields.product, PanelImage):
        return (*PANEL, encoding.JPEG) if isinstance(fields, EiaFields) and fields.lossy else PANEL
    return (encoding.ZIP,) if isinstance(fields.product, AllViews) else PICTURES


def job_of(
    request: Request,
    state: State,
    fields: Views,
    *,
    source: SceneSource,
    display: DisplayProfile,
    camera: str | Camera | None,
) -> Job:
    """The job of a request for a picture. Raises ProblemError and LfdError for what makes none."""
    media = choose(request.headers.get("accept"), offered(fields))
    job = Job(fields.product, media, source, display, fields.choices(camera))
    check_plan(job, state.settings.max_view_pixels)
    return job


async def answer(request: Request, state: State, job: Job) -> Response:
    """The job's picture, or 304 where the client has it."""
    tag = f'"{job.key}"'
    headers = {
        "ETag": tag,
        "Vary": "Accept, Origin",
        "Cache-Control": "private, no-cache",
        "X-Content-Type-Options": "nosniff",
    }
    if _matches(request.headers.get("if-none-match"), tag):
        state.metrics.cached.labels("not modified").inc()
        return Response(status_code=304, headers=headers)
    if request.method == "HEAD":
        return _bare(headers | {"Content-Type": job.media})
    picture = state.answers.get(job.key)
    if picture is not None:
        state.metrics.cached.labels("answer").inc()
        headers["Server-Timing"] = 'cache;desc="hit"'
    else:
        result = await racing(request, state, job)
        request.scope["lfd.spans"] = result.timings_ms
        picture = Picture(memoryview(result.body), _described(job, result))
        state.answers.put(job.key, picture, len(picture.body))
        headers["Server-Timing"] = server_timing(result.timings_ms)
    return PiecesResponse(picture.body, headers=headers | picture.headers, media_type=job.media)


def _bare(headers: dict[str, str]) -> Response:
    """The answer to HEAD: no length is told, since none is known before the picture is made."""
    response = Response(headers=headers)
    del response.headers["content-length"]
    return response


async def racing(request: Request, state: State, job: Job) -> Result:
    """The job's result, or ClientGoneError as soon as the client goes."""
    work = asyncio.create_task(state.pool.run(job))
    gone = asyncio.create_task(_disconnected(request))
    try:
        await asyncio.wait((work, gone), return_when=asyncio.FIRST_COMPLETED)
        if not work.done():
            raise ClientGoneError
        result = work.result()
    finally:
        work.cancel()
        gone.cancel()
    state.metrics.observe(result.timings_ms)
    return result


async def _disconnected(request: Request) -> None:
    while (await request.receive())["type"] != "http.disconnect":
        pass


def server_timing(timings_ms: dict[str, float]) -> str:
    """The value of a Server-Timing header."""
    return ", ".join(f"{name};dur={ms:g}" for name, ms in timings_ms.items())


def _described(job: Job, result: Result) -> dict[str, str]:
    """What a header says of a picture: its size, its name, and what a person should know."""
    report = result.report
    assert job.scene is None or job.display is not None
    named = {"LFD-Size": "x".join(map(str, report["size"]))}
    if warnings := report.get("warnings"):
        named["LFD-Warnings"] = _header_text("; ".join(warnings))
    name = type(job.product).__name__.lower()
    named["Content-Disposition"] = f'inline; filename="{name}.{_SUFFIXES[job.media]}"'
    return named


def _header_text(text: str) -> str:
    """A text that a header can carry."""
    plain = text.encode("ascii", "replace").decode()
    return "".join(c if c.isprintable() else " " for c in plain)[:1000]


def _matches(header: str | None, tag: str) -> bool:
    """Whether If-None-Match names a tag (RFC 9110, section 13.1.2)."""
    if header is None:
        return False
    tags = [part.strip().removeprefix("W/") for part in header.split(",")]
    return "*" in tags or tag in tags

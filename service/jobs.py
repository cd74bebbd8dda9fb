"""Jobs: what takes long is made in the background, watched, called off, fetched."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Sequence
from contextlib import ExitStack
from typing import Annotated, Any, BinaryIO

from fastapi import APIRouter, Header, Request, Response
from fastapi import Path as PathParameter
from pydantic import Field

from lfd_render.engine.jobs import Job
from lfd_render.errors import LfdError

from .fields import AnyBody, Fields
from .job_store import JobState, StoredJob
from .orders import of_body
from .problems import Problem, ProblemError, as_problem, links, responses
from .responses import ALWAYS, PIECE_BYTES, LiveResponse, matches
from .state import Shared, State

router = APIRouter(prefix="/v1", tags=["jobs"])

MOST_PICTURES = 1000
_HEARTBEAT_S = 15.0
JobId = Annotated[str, PathParameter(max_length=100)]
Prefer = Annotated[
    str | None,
    Header(
        max_length=255, description="respond-async: answer 202, and make it in the background.",
        examples=["respond-async"],
    ),
]  # fmt: skip
IdempotencyKey = Annotated[
    str | None,
    Header(
        max_length=255,
        description="The same key with the same pictures gives the same job, not another.",
    ),
]


class KeptPicture(Fields):
    """A finished picture."""

    url: str
    media: str
    bytes: int


class JobAnswer(Fields):
    """A job. part: what is done of it, 0 to 1; pictures: by their numbers, null until they are
    made; problem: why it failed. created, finished: seconds since 1970."""

    id: str
    state: JobState
    part: float
    created: float
    finished: float | None = None
    pictures: list[KeptPicture | None]
    problem: Problem | None = None


class JobList(Fields):
    """All jobs, the newest first."""

    jobs: list[JobAnswer]


class JobBody(Fields):
    """Pictures to make in the background, each as /v1/render takes it."""

    pictures: list[AnyBody] = Field(
        min_length=1,
        max_length=MOST_PICTURES,
        examples=[[{"picture": "eia", "scene": "builtin:spheres", "yaw": 10}]],
    )
    accept: Annotated[str, Field(max_length=200)] | None = Field(
        None, description="Their media type, as Accept says it.", examples=["image/webp"]
    )


LATER: dict[str, Any] = {
    "model": JobAnswer,
    "description": "It is being made, for `Prefer: respond-async`.",
    "headers": {
        "Location": {"schema": {"type": "string"}, "description": "The job."},
        "Retry-After": {"schema": {"type": "string"}, "description": "Seconds to the next look."},
    },
    "links": links(
        {"job": "$response.body#/id"},
        see="get_job_v1_jobs__job__get",
        watch="job_events_v1_jobs__job__events_get",
        fetch="job_result_v1_jobs__job__result_get",
        cancel="delete_job_v1_jobs__job__delete",
    ),
}
_PICTURE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The picture.",
        "content": {"*/*": {"schema": {"type": "string", "format": "binary"}}},
    },
    304: {"description": "The client has it."},
    **responses(406, 409, 504, 507),
}


_EVENT = {
    "type": "object",
    "properties": {"event": {"enum": ["progress", "end"]}, "data": {"type": "string"}},
}


def wants_later(request: Request) -> bool:
    """Whether a request prefers 202 and a job (RFC 7240)."""
    said = ",".join(request.headers.getlist("prefer")).lower().split(",")
    return any(part.partition(";")[0].strip() == "respond-async" for part in said)


async def accepted(request: Request, state: State, jobs: Sequence[Job]) -> Response:
    """The answer 202 of jobs that are made from now on."""
    given = request.headers.get("idempotency-key")
    key = None if given is None else (request.scope["lfd.who"], given)
    stored = await state.jobs.create(jobs, key)
    return _answer(stored, 202, {"Preference-Applied": "respond-async"})


def _described(stored: StoredJob) -> JobAnswer:
    told = stored.problem
    kept = [stored.kept.get(number) for number in range(len(stored.jobs))]
    return JobAnswer(
        id=stored.id,
        state=stored.state,
        part=round(stored.part, 4),
        created=stored.created,
        finished=stored.finished,
        pictures=[
            KeptPicture(
                url=f"/v1/jobs/{stored.id}/results/{number}",
                media=stored.jobs[number].media,
                bytes=picture.bytes,
            )
            if picture
            else None
            for number, picture in enumerate(kept)
        ],
        problem=Problem.of(told) if told else None,
    )


def _answer(
    stored: StoredJob, status: int = 200, headers: dict[str, str] | None = None
) -> Response:
    more = {"Location": f"/v1/jobs/{stored.id}", "Cache-Control": "no-store"} | (headers or {})
    if stored.finished is None:
        more["Retry-After"] = "1"
    return Response(_described(stored).model_dump_json(), status, more, "application/json")


@router.get("/jobs", summary="All jobs", responses=responses())
async def list_jobs(state: Shared) -> JobList:
    """All that are being made or kept, the newest first."""
    return JobList(jobs=[_described(stored) for stored in state.jobs.all()])


@router.post(
    "/jobs", summary="Make pictures in the background", status_code=202, response_class=Response,
    responses={202: LATER, **responses(406)},
)  # fmt: skip
async def create_job(
    request: Request, state: Shared, body: JobBody, idempotency_key: IdempotencyKey = None
) -> Response:
    """Any number of pictures, as the frames of a moving camera; each is there when it is made."""
    with ExitStack() as leases:
        jobs = []
        for number, picture in enumerate(body.pictures):
            try:
                job = of_body(state, picture, body.accept, later=True)
                jobs.append(leases.enter_context(job))
            except (LfdError, ProblemError) as error:
                told, field = as_problem(error), f"pictures.{number}"
                raise ProblemError(told.status_code, f"{field}: {told.detail}", field) from None
            await asyncio.sleep(0)  # others' turn
        return await accepted(request, state, jobs)


@router.get(
    "/jobs/{job}", summary="One job", response_class=Response,
    responses={200: {"model": JobAnswer, "description": "The job."}, **responses()},
)  # fmt: skip
async def get_job(job: JobId, state: Shared) -> Response:
    """How far it is, and where its pictures are."""
    return _answer(state.jobs.get(job))


@router.delete("/jobs/{job}", summary="Call a job off", status_code=204, responses=responses())
async def delete_job(job: JobId, state: Shared) -> Response:
    """Stop making its pictures, and forget those that are made."""
    state.jobs.delete(job)
    return Response(status_code=204)


@router.get(
    "/jobs/{job}/events", summary="Progress of a job", response_class=Response,
    responses={
        200: {
            "description": "Server-sent events: `progress` with the job, the last one `end`.",
            "content": {"text/event-stream": {"schema": _EVENT}},
        },
        **responses(),
    },
)  # fmt: skip
async def job_events(job: JobId, state: Shared) -> Response:
    """The job now, and again whenever more of it is done, until it ends."""
    return LiveResponse(
        _events(state.jobs.get(job)),
        "text/event-stream",
        {"Cache-Control": "no-store"},
        until=state.ending,
    )


async def _events(stored: StoredJob) -> AsyncGenerator[bytes]:
    async for news in stored.changes(_HEARTBEAT_S):
        if not news:
            yield b": still here\n\n"
            continue
        kind = "progress" if stored.finished is None else "end"
        data = _described(stored).model_dump_json()
        yield f"event: {kind}\ndata: {data}\n\n".encode()


@router.get(
    "/jobs/{job}/result", summary="The picture of a job", response_class=Response,
    responses=_PICTURE,
)  # fmt: skip
async def job_result(request: Request, job: JobId, state: Shared) -> Response:
    """The picture of a job that has one, or the problem that it met."""
    stored = state.jobs.get(job)
    if len(stored.jobs) > 1:
        raise ProblemError(409, f"result: the job has {len(stored.jobs)}; ask for results/0", "job")
    return _result(request, stored, 0)


@router.get(
    "/jobs/{job}/results/{number}", summary="One picture of a job", response_class=Response,
    responses=_PICTURE,
)  # fmt: skip
async def job_results(
    request: Request, job: JobId, number: Annotated[int, PathParameter(ge=0)], state: Shared
) -> Response:
    """A picture by its number, as soon as it is made."""
    stored = state.jobs.get(job)
    if number >= len(stored.jobs):
        raise ProblemError(404, f"number: {number}; the job has {len(stored.jobs)}", "number")
    return _result(request, stored, number)


def _result(request: Request, stored: StoredJob, number: int) -> Response:
    kept = stored.kept.get(number)
    if kept is None:
        if stored.problem is not None:
            told = stored.problem
            raise ProblemError(told.status_code, told.detail, told.field)
        raise ProblemError(409, f"picture {number} is not made yet", "job", {"Retry-After": "1"})
    tag = {"ETag": kept.headers["ETag"]}
    if matches(request.headers.get("if-none-match"), kept.headers["ETag"]):
        return Response(status_code=304, headers=tag)
    try:
        file = kept.file.open("rb")
    except OSError:
        raise ProblemError(404, f"picture {number}: has expired", "job") from None
    headers = ALWAYS | kept.headers | {"Content-Length": str(kept.bytes)}
    return LiveResponse(_pieces(file), kept.headers["Content-Type"], headers)


async def _pieces(file: BinaryIO) -> AsyncGenerator[bytes]:
    with file:
        while piece := await asyncio.to_thread(file.read, PIECE_BYTES):
            yield piece

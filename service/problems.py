"""Errors as ``application/problem+json`` (RFC 9457), whatever they are."""

from __future__ import annotations

import errno
import re
from collections.abc import Sequence
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, Field
from starlette.exceptions import HTTPException
from starlette.routing import BaseRoute, Match, Route
from starlette.types import Scope

from lfd_render.engine.pool import InternalError
from lfd_render.errors import BusyError, LfdError, OptionError, http_status

MEDIA = "application/problem+json"
_PICTURES = ("eia", "look", "views", "view", "quilt")
# What the machine lacks: room on its disk, or handles for files.
_FULL = {
    errno.ENOSPC: 507, errno.EDQUOT: 507, errno.EROFS: 507,
    errno.EMFILE: 503, errno.ENFILE: 503,
}  # fmt: skip
_TYPE = re.compile(r"[^\w]|^(?:int|float|str|bool|none)$")


class ProblemError(HTTPException):
    """A problem that a handler found."""

    def __init__(
        self,
        status: int,
        detail: str,
        field: str | None = None,
        headers: dict[str, str] | None = None,
    ) -> None:
        super().__init__(status, detail, headers)
        self.field = field


class Problem(BaseModel):
    """What went wrong, as RFC 9457 says it; `field` is the part of the request at fault."""

    type: str = "about:blank"
    title: str = Field(examples=["Unprocessable Content"])
    status: int = Field(examples=[422])
    detail: str = Field(examples=["views: Input should be less than or equal to 1024"])
    field: str | None = Field(None, examples=["views"])
    request_id: str | None = Field(None, examples=["5f0c9d1c3a7b4e22"])

    @staticmethod
    def of(error: ProblemError, request_id: str | None = None) -> Problem:
        """As JSON says it."""
        return Problem(
            title=HTTPStatus(error.status_code).phrase, status=error.status_code,
            detail=_whole(error.detail), field=error.field and _whole(error.field),
            request_id=request_id,
        )  # fmt: skip


def _whole(text: str) -> str:
    """A text without halves of characters, which UTF-8 does not hold."""
    return text.encode("utf-8", "replace").decode()


def as_problem(error: BaseException) -> ProblemError:
    """The problem that an error is to whoever made the request."""
    if isinstance(error, ProblemError):
        return error
    if isinstance(error, OSError) and error.errno in _FULL:
        status = _FULL[error.errno]
        headers = {"Retry-After": "5"} if status == HTTPStatus.SERVICE_UNAVAILABLE else None
        return ProblemError(status, f"{error.strerror}; ask again later", None, headers)
    if not isinstance(error, LfdError):
        return ProblemError(500, "internal error; the server's log says more")
    status, headers = http_status(error), None
    if isinstance(error, BusyError):
        headers = {"Retry-After": str(error.retry_after_s)}
    elif status == HTTPStatus.SERVICE_UNAVAILABLE:
        headers = {"Retry-After": "5"}
    field = error.option if isinstance(error, OptionError) else _named(str(error))
    return ProblemError(status, str(error), field, headers)


def problem(
    request_id: str | None,
    status: int,
    detail: str,
    field: str | None = None,
    headers: dict[str, str] | None = None,
) -> Response:
    """The response that tells of a problem."""
    told = Problem.of(ProblemError(status, detail, field), request_id)
    body = told.model_dump_json(exclude_none=True)
    return Response(body, status, headers, MEDIA)


def responses(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """For OpenAPI: these statuses and those that every request may meet, as problems."""
    always = (400, 401, 403, 404, 405, 413, 421, 422, 429, 500, 503)
    schema = {"$ref": "#/components/schemas/Problem"}
    return {
        status: {
            "description": HTTPStatus(status).phrase,
            "content": {MEDIA: {"schema": schema}},
        }
        for status in sorted({*always, *statuses})
    }


def links(parameters: dict[str, str], **operations: str) -> dict[str, Any]:
    """For OpenAPI: what can be done with what an answer names, by operations' ids."""
    return {
        name: {"operationId": operation, "parameters": parameters}
        for name, operation in operations.items()
    }


def install(app: FastAPI, routes: Sequence[BaseRoute]) -> None:
    """Answer every error of the application, which has these routes, with a problem."""

    def answer(
        request: Request,
        status: int,
        detail: str,
        field: str | None = None,
        headers: dict[str, str] | None = None,
    ) -> Response:
        return problem(request.scope.get("request_id"), status, detail, field, headers)

    @app.exception_handler(ProblemError)
    @app.exception_handler(LfdError)
    @app.exception_handler(InternalError)
    async def own(request: Request, error: Exception) -> Response:
        told = as_problem(error)
        headers = dict(told.headers) if told.headers else None
        return answer(request, told.status_code, told.detail, told.field, headers)

    @app.exception_handler(OSError)
    async def full(request: Request, error: OSError) -> Response:
        if error.errno not in _FULL:
            raise error
        return await own(request, error)

    @app.exception_handler(RequestValidationError)
    async def invalid(request: Request, error: RequestValidationError) -> Response:
        first = error.errors()[0]
        field = "body" if first["type"] == "json_invalid" else place(first["loc"])
        return answer(request, 422, f"{field}: {first['msg']}", field)

    @app.exception_handler(HTTPException)
    async def http(request: Request, error: HTTPException) -> Response:
        headers = dict(error.headers or {})
        if error.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
            headers["Allow"] = ", ".join(sorted(_allowed(routes, request.scope)))
        return answer(request, error.status_code, str(error.detail), None, headers)


def _allowed(routes: Sequence[BaseRoute], scope: Scope) -> set[str]:
    """The methods of a path: of all its routes, where one alone knows but its own."""
    found = set()
    for route in routes:
        if isinstance(route, Route) and route.matches(scope)[0] != Match.NONE:
            found |= route.methods or set()
    return found


def place(location: tuple[int | str, ...]) -> str:
    """The field of a request that a validation names: without where it stands, which picture's
    class it is of, and which of a field's types failed."""
    where, *parts = map(str, location)
    if where == "body" and len(parts) > 1 and parts[0] in _PICTURES:
        del parts[0]
    return ".".join(part for part in parts if not _TYPE.search(part)) or where


def _named(detail: str) -> str | None:
    """The field that a message of the renderer begins with, where it does."""
    name, colon, _ = detail.partition(":")
    words = name.split("'")[0].split()
    known = colon and 1 <= len(words) <= 3 and all(word.isidentifier() for word in words)
    return "_".join(words) if known else None

"""The outermost layer: request ids, a JSON line a request or socket, metrics, unexpected errors."""

from __future__ import annotations

import json
import logging
import re
import sys
import time
import traceback
import uuid
from contextlib import suppress
from typing import Any

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from .clients import ClientGoneError
from .metrics import Metrics
from .problems import problem

_log = logging.getLogger("lfd_render.service")
_OURS = ("lfd_render", "uvicorn.error")
_CLIENT_GONE = 499
_INTERNAL = 1011  # why a socket closes (RFC 6455, section 7.4)
_METHODS = ("GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS")  # others make no series of their own
_PLAIN = set(vars(logging.makeLogRecord({}))) | {"message", "asctime", "color_message"}


class JsonLines(logging.Formatter):
    """A record as one JSON object."""

    def format(self, record: logging.LogRecord) -> str:
        """Time, level, message and what else the record was given."""
        told: dict[str, Any] = {
            "time": round(record.created, 3),
            "level": record.levelname.lower(),
            "message": record.getMessage(),
        }
        told |= {k: v for k, v in vars(record).items() if k not in _PLAIN and v is not None}
        if record.exc_info:
            told["trace"] = self.formatException(record.exc_info)
        return json.dumps(told, default=str)


def log_json(level: str) -> None:
    """Send this program's log lines to stderr as JSON."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonLines())
    for name in _OURS:
        logger = logging.getLogger(name)
        logger.handlers = [handler]
        logger.setLevel(level.upper())
        logger.propagate = False


class Journal:
    """Gives each request an id, its own where it is plain, and tells how it ended."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app = app
        self._metrics = metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """As ASGI has it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        socket = scope["type"] == "websocket"
        given = Headers(scope=scope).get("x-request-id", "")
        known = re.fullmatch(r"[\w.-]{1,64}", given)
        scope["request_id"] = given if known else uuid.uuid4().hex[:16]
        started = time.perf_counter()
        status, sent = 0, 0

        async def noting(message: Message) -> None:
            nonlocal status, sent
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)["X-Request-Id"] = scope["request_id"]
            elif message["type"] == "websocket.close":
                status = message.get("code", 1000)
            sent += len(message.get("body") or message.get("bytes") or message.get("text") or b"")
            await send(message)

        async def heard() -> Message:
            nonlocal status
            message = await receive()
            if message["type"] == "websocket.disconnect":
                status = status or message.get("code", 1005)
            return message

        trace = None
        try:
            await self._app(scope, heard if socket else receive, noting)
        except ClientGoneError:
            status = _CLIENT_GONE
        except Exception:
            trace = traceback.format_exc()
            if socket:
                with suppress(Exception):  # it may be closed
                    await noting({"type": "websocket.close", "code": _INTERNAL})
            elif not status:
                detail = "internal error; the server's log says more"
                await problem(scope["request_id"], 500, detail)(scope, receive, noting)
        seconds = time.perf_counter() - started
        if not socket:  # they stay open as long as they like, and clients say why they close
            self._count(scope, status, seconds)
        if trace or scope["path"] not in ("/livez", "/readyz", "/metrics"):
            _log.log(
                logging.ERROR if trace else logging.INFO,
                "request",
                extra={
                    "request_id": scope["request_id"],
                    "method": scope.get("method", "WEBSOCKET"),
                    "path": scope["path"],
                    "query": scope["query_string"].decode("latin-1"),
                    "status": status,
                    "ms": round(1000 * seconds, 3),
                    "bytes": sent,
                    "client": (scope.get("client") or [None])[0],
                    "spans_ms": scope.get("lfd.spans"),
                    "trace": trace,
                },
            )

    def _count(self, scope: Scope, status: int, seconds: float) -> None:
        route = getattr(scope.get("route"), "path", "none")
        method = scope["method"] if scope["method"] in _METHODS else "other"
        self._metrics.requests.labels(route, method, str(status)).inc()
        self._metrics.seconds.labels(route).observe(seconds)

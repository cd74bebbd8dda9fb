"""Streams: frames of a moving camera, for people as they see the panel, for players as it takes
them.

Whoever reads slowly gets fewer frames, each the newest when it is begun; while nobody reads, none
is made.
"""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import AsyncGenerator
from contextlib import suppress
from typing import Annotated, Any, Literal, TypeVar

from fastapi import APIRouter, Query, Response, WebSocket, WebSocketDisconnect
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from lfd_render.engine import encoding
from lfd_render.engine.jobs import Job, Result
from lfd_render.engine.motion import to_and_fro, turned
from lfd_render.engine.pool import InternalError
from lfd_render.errors import BusyError, LfdError

from .fields import AnyQuery, Degrees, EiaQuery, Fields, LookQuery, Positive
from .orders import of_query
from .pictures import SceneId
from .problems import Problem, ProblemError, as_problem, place, responses
from .responses import LiveResponse
from .state import Shared, State

router = APIRouter(prefix="/v1", tags=["streams"])

_WINDOW = 2  # frames on their way to a player that it has not acknowledged
_BOUNDARY = "lfd-frame"
_POLICY, _INTERNAL, _LATER = 1008, 1011, 1013  # why a socket closes (RFC 6455, and its registry)


class Moving(BaseModel):
    """How the camera moves, frame by frame: frame n shows the time n / fps."""

    period: float = Field(12.0, ge=0.1, le=3600, description="Seconds to come round again.")
    swing: Annotated[float, Field(ge=0, lt=90)] = Field(
        15.0, description="Degrees to either side, where it goes to and fro."
    )
    fps: float = Field(12.0, ge=0.01, le=60, description="Frames a second at most.")
    frames: int | None = Field(
        None,
        ge=1,
        le=1_000_000,
        description="End before the frame of this number; slow readers get fewer.",
    )

    def turned(self, frame: int) -> float:
        """Degrees of a full turn."""
        return turned(frame / self.fps, self.period)

    def swung(self, frame: int) -> float:
        """Degrees to the right of the middle."""
        return self.swing * to_and_fro(frame / self.fps, self.period)


class SeenQuery(LookQuery, Moving):
    """Query of a moving virtual panel."""

    motion: Literal["eye", "orbit", "sway"] = Field(
        "eye", description="The eye goes to and fro, or the scene turns round, or to and fro."
    )

    def at(self, frame: int) -> SeenQuery:
        """What the frame shows."""
        match self.motion:
            case "eye":
                return self.model_copy(
                    update={"angle": self.swung(frame), "eye": None, "sweep": None}
                )
            case "orbit":
                return self.model_copy(update={"yaw": self.yaw + self.turned(frame)})
            case _:
                return self.model_copy(update={"yaw": self.yaw + self.swung(frame)})


class PlayerQuery(EiaQuery, Moving):
    """Query of moving panel images."""

    motion: Literal["orbit", "sway", "none"] = Field(
        "orbit", description="The scene turns round, or to and fro, or as the player says."
    )
    media: Literal["image/png", "image/webp", "application/octet-stream"] = Field(
        "image/png", description="How frames are encoded; octet-stream: bare RGB rows."
    )

    def at(self, frame: int) -> PlayerQuery:
        """What the frame shows."""
        if self.motion == "none":
            return self
        turned = self.turned(frame) if self.motion == "orbit" else self.swung(frame)
        return self.model_copy(update={"yaw": self.yaw + turned})


class Said(Fields):
    """What a player says: which frame it has shown, and where the camera is to go."""

    model_config = ConfigDict(strict=True)

    ack: int | None = Field(None, ge=0)
    yaw: Degrees | None = None
    pitch: Degrees | None = None
    depth_scale: Positive | None = None


class _Clock:
    """Which frame is due, on a clock that starts when the first one has been taken."""

    def __init__(self, moving: Moving) -> None:
        self._moving = moving
        self._frame, self._started = -1, 0.0

    async def next(self) -> int | None:
        """The number of the newest frame, once its time has come; None after the last."""
        now, fps = asyncio.get_running_loop().time(), self._moving.fps
        if self._frame <= 0:
            self._started = now
        passed = now - self._started
        self._frame = max(self._frame + 1, math.floor(passed * fps))
        if self._moving.frames is not None and self._frame >= self._moving.frames:
            return None
        await asyncio.sleep(self._frame / fps - passed)
        return self._frame


@router.get(
    "/scenes/{scene}/stream", summary="A moving virtual panel", response_class=Response,
    responses={
        200: {
            "description": "JPEG pictures one after the other, as <img> shows them.",
            "content": {
                "multipart/x-mixed-replace": {"schema": {"type": "string", "format": "binary"}}
            },
        },
        **responses(504, 507),
    },
)  # fmt: skip
async def stream(scene: SceneId, state: Shared, query: Annotated[SeenQuery, Query()]) -> Response:
    """What an eye sees while it, or the scene, moves. As a WebSocket, the same address sends panel
    images to players: see docs/service.md."""
    return LiveResponse(
        _mjpeg(state, scene, query),
        f"multipart/x-mixed-replace; boundary={_BOUNDARY}",
        {"Cache-Control": "no-store", "X-Content-Type-Options": "nosniff"},
        until=state.ending,
    )


async def _mjpeg(state: State, scene: str, query: SeenQuery) -> AsyncGenerator[bytes]:
    clock = _Clock(query)
    mark = f"--{_BOUNDARY}"
    with state.streams.slot():
        while (frame := await clock.next()) is not None:
            _, result = await _made(state, scene, query.at(frame), encoding.JPEG, frame == 0)
            head = (
                f"Content-Type: {encoding.JPEG}\r\nContent-Length: {len(result.body)}\r\n"
                f"LFD-Frame: {frame}\r\n\r\n"
            )
            # The mark of the next part goes along, or a browser would wait for it.
            opening = f"{mark}\r\n" if frame == 0 else ""
            yield f"{opening}{head}".encode() + result.body + f"\r\n{mark}\r\n".encode()
        yield b"\r\n"


async def _made(
    state: State, scene: str, query: AnyQuery, media: str, impatient: bool
) -> tuple[Job, Result]:
    """A frame. One that the queue has no place for is asked for again, unless impatient."""
    while True:
        with of_query(state, scene, query, media) as job:
            try:
                result = await state.pool.run(job)
            except BusyError as busy:
                if impatient:
                    raise
                wait_s = busy.retry_after_s
            else:
                state.metrics.observe(result.timings_ms)
                return job, result
        await asyncio.sleep(wait_s)


@router.websocket("/scenes/{scene}/stream")
async def play(socket: WebSocket, scene: str) -> None:
    """Send panel images to a player, each after a line of JSON that tells of it."""
    await socket.accept()
    state: State = socket.app.state.lfd
    code, reason = 1000, ""
    try:
        query = _parsed(PlayerQuery, dict(socket.query_params))
        with state.streams.slot():
            await _Player(socket, state, scene, query).play()
    except WebSocketDisconnect:
        return
    except (ProblemError, LfdError, InternalError) as error:
        told = as_problem(error)
        code = _INTERNAL if told.status_code >= 500 else _POLICY
        code, reason = (_LATER if told.status_code in (429, 503) else code), told.detail[:100]
        problem = {"problem": Problem.of(told).model_dump(exclude_none=True)}
        with suppress(WebSocketDisconnect, TimeoutError):
            await _soon(state, socket.send_json(problem))
    with suppress(WebSocketDisconnect, RuntimeError, TimeoutError):
        await _soon(state, socket.close(code, reason))


class _Player:
    """One who shows panel images, and says which it has shown and where the camera is to go."""

    def __init__(self, socket: WebSocket, state: State, scene: str, query: PlayerQuery) -> None:
        self._socket, self._state, self._scene, self._query = socket, state, scene, query
        self._sent: list[int] = []  # and not acknowledged
        self._news = asyncio.Event()

    async def play(self) -> None:
        """Send frames until the player goes, the last one is sent, or the server ends."""
        tasks = [
            asyncio.create_task(work)
            for work in (self._listen(), self._send(), self._state.ending.wait())
        ]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks)

    async def _listen(self) -> None:
        while True:
            message = await self._socket.receive()
            if message["type"] == "websocket.disconnect":
                raise WebSocketDisconnect(message.get("code", 1005))
            said = _parsed(Said, message.get("text") or "")
            if said.ack is not None:
                self._sent = [frame for frame in self._sent if frame > said.ack]
            moved = said.model_dump(exclude={"ack"}, exclude_none=True)
            self._query = self._query.model_copy(update=moved)
            self._news.set()

    async def _send(self) -> None:
        clock = _Clock(self._query)
        shown = None
        while (frame := await clock.next()) is not None:
            while len(self._sent) >= _WINDOW:
                await self._hear('frames are no longer acknowledged; say {"ack": FRAME}')
                # The newest then, not the one that was due before.
                frame = await clock.next()
                if frame is None:
                    return
            query = self._query.at(frame)
            if query == shown:
                self._news.clear()
                await self._news.wait()
                continue
            job, result = await _made(self._state, self._scene, query, query.media, shown is None)
            shown = query
            about = {
                "frame": frame, "media": job.media, "size": result.report["size"],
                "bytes": len(result.body), "etag": self._state.pool.tag(job), "yaw": query.yaw,
                "pitch": query.pitch, "timings_ms": result.timings_ms,
            }  # fmt: skip
            self._sent.append(frame)
            try:
                await _soon(self._state, self._socket.send_text(json.dumps(about)))
                await _soon(self._state, self._socket.send_bytes(bytes(result.body)))
            except TimeoutError:
                raise WebSocketDisconnect(1006) from None

    async def _hear(self, silence: str) -> None:
        """Wait for the player to say something. Raises ProblemError when it says nothing."""
        self._news.clear()
        try:
            await _soon(self._state, self._news.wait())
        except TimeoutError:
            raise ProblemError(408, silence, "ack") from None


M = TypeVar("M", bound=BaseModel)


def _parsed(model: type[M], given: dict[str, Any] | str) -> M:
    """What a player says. Raises ProblemError."""
    try:
        if isinstance(given, str):
            return model.model_validate_json(given)
        return model.model_validate(given)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = place(("message", *first["loc"]))
        raise ProblemError(422, f"{field}: {first['msg']}", field) from None


async def _soon(state: State, work: Any) -> Any:
    """What the work gives, if within what a client may keep the server waiting."""
    async with asyncio.timeout(state.settings.idle_s):
        return await work

"""The server as `lfd-render serve` starts it."""

from __future__ import annotations

import asyncio
import ctypes
import logging
import resource
import socket
import struct
from collections.abc import Callable
from contextlib import suppress

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle

from lfd_render.errors import OutputError, UsageError

from .app import create_app
from .guards import is_loopback
from .settings import Settings

_KEEP_ALIVE_S = 30
_HEARING_S = 0.5  # until those whose connection is made have been accepted and have begun to speak
_CROWDED = (
    b"HTTP/1.1 429 Too Many Requests\r\nRetry-After: 10\r\nConnection: close\r\n"
    b"Content-Length: 0\r\n\r\n"
)  # sent before anything is read, so that the connection takes no more than its place
_SO_ATTACH_FILTER = 26  # linux/socket.h
_BPF_RETURN = 6  # linux/bpf_common.h: BPF_RET | BPF_K


def run(settings: Settings, say: Callable[[str], None]) -> None:
    """Serve until told to end. `say` hears the address, once it listens.

    Raises UsageError for an address that others can reach without keys, OutputError for one
    or a folder that cannot be had, GpuError when no render process starts.
    """
    if not settings.api_keys and not is_loopback(settings.host):
        raise UsageError(
            f"--host: {settings.host}: others can reach it; set LFD_API_KEYS, or use 127.0.0.1"
        )
    _take_descriptors()
    app = create_app(settings)
    with _listening(settings) as listener:
        host, port = listener.getsockname()[:2]
        said = f"[{host}]" if ":" in host else host
        server = _Server(
            uvicorn.Config(
                app, http=_patient(settings.idle_s, settings.max_connections), lifespan="on",
                log_config=None, access_log=False, server_header=False,
                timeout_keep_alive=_KEEP_ALIVE_S,
                timeout_graceful_shutdown=round(settings.drain_s) + 1,
                ws_max_size=1 << 16, ws_per_message_deflate=False,
            ),
            lambda: say(f"listening on http://{said}:{port}"),
        )  # fmt: skip
        # Why the application cannot start is raised, not logged as a trace.
        logging.getLogger("uvicorn.error").addFilter(lambda _: app.state.failure is None)
        try:
            server.run(sockets=[listener])
        except SystemExit:
            if app.state.failure is None:
                raise
    if app.state.failure is not None:
        raise app.state.failure


def _take_descriptors() -> None:
    """As many open files as this process may have: sockets and large pictures take one each."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft != hard:
        with suppress(ValueError, OSError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))


def _listening(settings: Settings) -> socket.socket:
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    try:
        made = socket.create_server((settings.host, settings.port), family=family, backlog=1024)
    except OSError as error:
        raise OutputError(
            f"--port: {settings.host}:{settings.port}: {error.strerror}; choose another"
        ) from error
    # Connections inherit these. asyncio asks for the first itself, but not where a socket names no
    # protocol, as this one's do; without it an answer's second packet, its body, waits some 40 ms
    # for the client's kernel to acknowledge the first.
    made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    # Closing one politely waits for a client to take what was sent; one
    # that never does would keep it for good.
    made.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, round(1000 * settings.idle_s))
    return made


def _patient(idle_s: float, most: int) -> type[H11Protocol]:
    """HTTP that hangs up on clients who have not begun a request for so long, or not finished its
    first lines. Bodies and answers have times of their own. most: connections of one address."""

    class Patient(H11Protocol):
        _last: RequestResponseCycle | None = None  # when it was looked at last

        def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
            super().connection_made(transport)
            if most and self.client:
                ends = [getattr(each, "client", None) for each in self.connections]
                if sum(end is not None and end[0] == self.client[0] for end in ends) > most:
                    transport.write(_CROWDED)
                    transport.close()
                    return
            self.loop.call_later(idle_s, self._look)

        def _look(self) -> None:
            if self.transport.is_closing() or self.transport.get_protocol() is not self:
                return  # gone, or become a WebSocket
            waiting = self.cycle is None or self.cycle.response_complete
            if waiting and self.cycle is self._last:
                self.transport.abort()
                return
            self._last = self.cycle
            self.loop.call_later(idle_s, self._look)

    return Patient


class _Server(uvicorn.Server):
    """Says so when it is up, and at its end takes all who have come."""

    def __init__(self, config: uvicorn.Config, up: Callable[[], None]) -> None:
        super().__init__(config)
        self._up = up

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start, and say so."""
        await super().startup(sockets)
        if self.started:
            self._up()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End. Closing the door would reset the connections that wait before it, so first nobody
        else comes in, and those who wait are heard."""
        for listener in sockets or []:
            _let_nobody_in(listener)
        await asyncio.sleep(_HEARING_S)
        await super().shutdown(sockets)


def _let_nobody_in(listener: socket.socket) -> None:
    """Drop the packets of connections that are being made, by a filter that passes none (Linux,
    socket(7)); once the door is closed they are told so."""
    instruction = ctypes.create_string_buffer(struct.pack("=HBBI", _BPF_RETURN, 0, 0, 0))
    program = struct.pack("@HP", 1, ctypes.addressof(instruction))
    listener.setsockopt(socket.SOL_SOCKET, _SO_ATTACH_FILTER, program)

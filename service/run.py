"""The server as `lfd-render serve` starts it."""

from __future__ import annotations

import logging
import socket
from collections.abc import Callable

import uvicorn

from lfd_render.errors import OutputError, UsageError

from .app import create_app
from .guards import is_loopback
from .settings import Settings

_KEEP_ALIVE_S = 30


def run(settings: Settings, say: Callable[[str], None]) -> None:
    """Serve until told to end. `say` hears the address, once it listens.

    Raises UsageError for an address that others can reach without keys, OutputError for one
    or a folder that cannot be had, GpuError when no render process starts.
    """
    if not settings.api_keys and not is_loopback(settings.host):
        raise UsageError(
            f"--host: {settings.host}: others can reach it; set LFD_API_KEYS, or use 127.0.0.1"
        )
    app = create_app(settings)
    with _listening(settings) as listener:
        host, port = listener.getsockname()[:2]
        said = f"[{host}]" if ":" in host else host
        server = _Server(
            uvicorn.Config(
                app, log_config=None, access_log=False, server_header=False, lifespan="on",
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


def _listening(settings: Settings) -> socket.socket:
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    try:
        made = socket.create_server((settings.host, settings.port), family=family, backlog=1024)
    except OSError as error:
        raise OutputError(
            f"--port: {settings.host}:{settings.port}: {error.strerror}; choose another"
        ) from error
    # Connections inherit it. Closing one politely waits for a client to take what was sent; one
    # that never does would keep it for good.
    made.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, round(1000 * settings.idle_s))
    return made


class _Server(uvicorn.Server):
    """Says so when it is up."""

    def __init__(self, config: uvicorn.Config, up: Callable[[], None]) -> None:
        super().__init__(config)
        self._up = up

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start, and say so."""
        await super().startup(sockets)
        if self.started:
            self._up()

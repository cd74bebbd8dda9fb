"""One render process as the pool sees it: started, spoken to, and noticed when it ends."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import Any

from lfd_render.engine.bodies import receive_body
from lfd_render.engine.encoding import clear_up
from lfd_render.engine.jobs import Done, Holds
from lfd_render.engine.worker import WorkerConfig
from lfd_render.errors import LfdError

_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
# A picture's memory serves the next one: fresh pages cost a 4K panel image 20 ms, on a virtual
# machine up to 100. Huge ones save a software device's frame a twentieth. Of glibc alone.
_ALLOCATION = {
    "GLIBC_TUNABLES": "glibc.malloc.hugetlb=1:glibc.malloc.mmap_threshold=33554432:"
    "glibc.malloc.trim_threshold=268435456"
}
NOTHING = Holds(frozenset(), frozenset(), None)


class RenderProcess:
    """A spawned process and the socket to it.

    on_message and on_end are called in the event loop: for each message, and once when the process
    has ended. It is started by exec, never by fork alone, which an OpenGL context does not survive.
    """

    def __init__(
        self,
        config: WorkerConfig,
        on_message: Callable[[RenderProcess, Any], None],
        on_end: Callable[[RenderProcess], None],
    ) -> None:
        self.renderer: str | None = None  # once it is ready
        self.software = False
        self.holds = NOTHING
        self.idle_since = 0.0  # on the monotonic clock
        self.condemned = False  # ended by us for what it did
        self._loop = asyncio.get_running_loop()
        self._on_message, self._on_end = on_message, on_end
        ours, theirs = socket.socketpair()
        with theirs:
            self._popen = subprocess.Popen(
                [
                    sys.executable, "-m", "lfd_render.engine.worker", str(theirs.fileno()),
                    config.to_text(),
                ],
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                env=_ALLOCATION | os.environ,
            )  # fmt: skip
        self._pipe = Connection(ours.detach())
        threading.Thread(target=self._read, daemon=True, name=f"render {self.pid}").start()

    @property
    def pid(self) -> int:
        """Its number with the operating system."""
        return self._popen.pid

    @property
    def returncode(self) -> int | None:
        """Exit code, negative for a signal; None while it runs."""
        return self._popen.poll()

    def send(self, message: object) -> None:
        """Send a message; one that no longer arrives is told by on_end."""
        with suppress(OSError):
            self._pipe.send(message)

    def resident_bytes(self) -> int:
        """Memory that it occupies; 0 when it has ended."""
        try:
            with open(f"/proc/{self.pid}/statm", encoding="ascii") as file:
                return int(file.read().split()[1]) * _PAGE_BYTES
        except (OSError, IndexError):
            return 0

    def condemn(self) -> None:
        """End it at once for what it does."""
        self.condemned = True
        self.kill()

    def kill(self) -> None:
        """End it at once."""
        with suppress(OSError):
            self._popen.send_signal(signal.SIGKILL)

    def close(self) -> None:
        """Let it end: it does when its socket closes, and is made to where it is busy."""
        self.kill()
        self._popen.wait()

    def _read(self) -> None:
        try:
            while True:
                message = self._pipe.recv()
                if isinstance(message, Done):
                    body = receive_body(self._pipe, message.body_bytes)
                    message = replace(message, result=replace(message.result, body=body))
                self._tell(self._on_message, self, message)
        except (EOFError, OSError, LfdError):
            self.kill()  # where it is not gone, what it says can no longer be followed
            self._popen.wait()
            clear_up(self.pid)
            self._pipe.close()
            self._tell(self._on_end, self)

    def _tell(self, handler: Callable[..., None], *arguments: object) -> None:
        with suppress(RuntimeError):  # the loop has closed: nobody listens
            self._loop.call_soon_threadsafe(handler, *arguments)

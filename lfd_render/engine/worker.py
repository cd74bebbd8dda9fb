"""A render process: ``python -m lfd_render.engine.worker FD CONFIG``, one GL context for life.

It takes jobs from the socket FD one at a time and ends when that closes. A second thread reads, so
that a job can be called off while it runs.
"""

from __future__ import annotations

import json
import os
import queue
import resource
import signal
import sys
import threading
import time
import traceback
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from multiprocessing.connection import Connection

from lfd_render.engine.bodies import send_body
from lfd_render.engine.jobs import Cancel, Done, Failed, Forget, NotReady, Progress, Ready, Work
from lfd_render.engine.workshop import Workshop
from lfd_render.errors import (
    CancelledError,
    GpuError,
    LfdError,
    ResourceError,
    UnsupportedError,
)
from lfd_render.renderer import Renderer

_TELLING_S = 0.2  # the least time between two words of progress


@dataclass(frozen=True)
class WorkerConfig:
    """How a render process is set up. memory_bytes: what it may allocate, 0 for no limit."""

    device: str = "auto"
    scene_bytes: int = 1 << 30
    frame_bytes: int = 1 << 28
    memory_bytes: int = 0

    def to_text(self) -> str:
        """As an argument of the process."""
        return json.dumps(asdict(self))


class Worker:
    """The process's end of the pipe."""

    def __init__(self, pipe: Connection, workshop: Workshop) -> None:
        self._pipe = pipe
        self._workshop = workshop
        self._work: queue.SimpleQueue[Work | Forget] = queue.SimpleQueue()
        self._cancelled: set[int] = set()

    def run(self) -> None:
        """Do what comes until the process ends."""
        threading.Thread(target=self._read, daemon=True, name="read").start()
        while True:
            message = self._work.get()
            if isinstance(message, Forget):
                self._workshop.forget(message.scene)
            else:
                self._do(message)

    def _read(self) -> None:
        try:
            while True:
                message = self._pipe.recv()
                if isinstance(message, Cancel):
                    self._cancelled.add(message.number)
                else:
                    self._work.put(message)
        except (EOFError, OSError):
            os._exit(0)  # whoever asked is gone; the device needs no farewell

    def _do(self, work: Work) -> None:
        number = work.number
        told = time.monotonic()

        def progress(part: float) -> None:
            nonlocal told
            if number in self._cancelled:
                raise CancelledError("called off")
            if time.monotonic() - told > _TELLING_S:
                told = time.monotonic()
                self._pipe.send(Progress(number, part))

        try:
            progress(0.0)
            result = self._workshop.make(work.job, progress)
        except Exception as error:
            self._pipe.send(self._failed(work, error))
            if isinstance(error, GpuError) and not isinstance(error, UnsupportedError):
                sys.exit(1)  # the context may be lost; the next process has a new one
        else:
            bare = replace(result, body=b"")
            self._pipe.send(Done(number, bare, self._workshop.holds(), len(result.body)))
            send_body(self._pipe, result.body)
        self._cancelled.discard(number)

    def _failed(self, work: Work, error: Exception) -> Failed:
        if isinstance(error, MemoryError):
            error = ResourceError("out of memory; use a smaller scene or smaller views")
        scene, holds = work.job.scene, self._workshop.holds()
        if not isinstance(error, LfdError):
            return Failed(work.number, "", (str(error),), traceback.format_exc(), holds)
        arguments = error.args
        if scene is not None:  # where its file lies is nobody's business
            arguments = tuple(str(a).replace(scene.path, scene.name) for a in arguments)
        return Failed(work.number, type(error).__name__, arguments, None, holds)


def main() -> None:
    """Open the device and serve."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal's goes to all; the pool decides
    pipe = Connection(int(sys.argv[1]))
    config = WorkerConfig(**json.loads(sys.argv[2]))
    if config.memory_bytes:
        # Of data alone: drivers reserve far more address space than they use.
        resource.setrlimit(resource.RLIMIT_DATA, (config.memory_bytes, config.memory_bytes))
    try:
        renderer = Renderer(config.device)
    except LfdError as error:
        with suppress(OSError):
            pipe.send(NotReady(str(error)))
        sys.exit(1)
    info = renderer.device.info
    pipe.send(Ready(info.renderer, info.software))
    Worker(pipe, Workshop(renderer, config.scene_bytes, config.frame_bytes)).run()


if __name__ == "__main__":
    main()

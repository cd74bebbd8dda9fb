"""Sequences on this machine: the service's render processes, kept busy with the frames ahead.

While one process reads a frame back and encodes it, another renders; whoever takes the results
writes them meanwhile.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Coroutine, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from itertools import islice
from types import TracebackType
from typing import Any, Self, TypeVar

from lfd_render.engine.jobs import Job, Result
from lfd_render.engine.pool import Pool, PoolSettings
from lfd_render.engine.worker import WorkerConfig

T = TypeVar("T")

_A_DAY_S = 86400.0  # a frame may take as long as it takes
_WAITING = 2  # frames in the queue, so that no process waits for the next


class LocalEngine:
    """A pool in a thread of its own."""

    def __init__(self, device: str, processes: int) -> None:
        self._processes = processes
        worker = WorkerConfig(device, frame_bytes=0)  # no frame is asked for twice
        self._pool = Pool(
            PoolSettings(processes, processes + _WAITING, deadline_s=_A_DAY_S, worker=worker)
        )
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True, name="engine")

    def __enter__(self) -> Self:
        self._thread.start()
        try:
            self._submit(self._pool.start()).result()
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._end()

    @property
    def name(self) -> str:
        """Where frames are rendered."""
        processes = f"{self._processes} process{'es' if self._processes > 1 else ''}"
        return f"{processes} on {self._pool.renderers[0]}"

    def facts(self, job: Job) -> dict[str, Any]:
        """What the scene holds; all processes load it at once. Raises the job's errors."""
        loads = [self._submit(self._pool.run(job)) for _ in range(self._processes)]
        return next(load.result().report for load in loads)

    def results(self, jobs: Iterable[tuple[int, Job]]) -> Iterator[tuple[int, Result]]:
        """Results under the numbers of their jobs, as they come. Raises the jobs' errors."""
        jobs = iter(jobs)
        running: dict[Future[Result], int] = {}
        while True:
            for number, job in islice(jobs, self._processes + _WAITING - len(running)):
                running[self._submit(self._pool.run(job))] = number
            if not running:
                return
            for done in wait(running, return_when=FIRST_COMPLETED).done:
                yield running.pop(done), done.result()

    def _submit(self, work: Coroutine[Any, Any, T]) -> Future[T]:
        return asyncio.run_coroutine_threadsafe(work, self._loop)

    async def _close(self) -> None:
        await self._pool.close()
        left = asyncio.all_tasks() - {asyncio.current_task()}
        for task in left:
            task.cancel()
        await asyncio.gather(*left, return_exceptions=True)

    def _end(self) -> None:
        self._submit(self._close()).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

"""Pictures that are made in the background, and kept until they are fetched or expire."""

from __future__ import annotations

import asyncio
import logging
import shutil
import time
import uuid
from collections.abc import AsyncIterator, Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from lfd_render.engine.jobs import Job
from lfd_render.engine.pool import Pool

from .picture import Picture
from .problems import ProblemError, as_problem
from .scene_store import SceneStore
from .settings import Settings

_log = logging.getLogger(__name__)

JobState = Literal["queued", "running", "done", "failed", "cancelled"]
Key = tuple[str, str]  # whose, and the Idempotency-Key


@dataclass(frozen=True)
class Kept:
    """A finished picture in a file."""

    file: Path
    bytes: int
    headers: dict[str, str]


class StoredJob:
    """Pictures that were asked for together, under an id."""

    def __init__(self, jobs: Sequence[Job], folder: Path) -> None:
        self.id = uuid.uuid4().hex
        self.jobs = tuple(jobs)
        self.folder = folder / self.id
        self.state: JobState = "queued"
        self.created = time.time()
        self.finished: float | None = None
        self.kept: dict[int, Kept] = {}  # by the picture's number
        self.problem: ProblemError | None = None
        self.expiry: asyncio.TimerHandle | None = None
        self._parts: dict[int, float] = {}  # done of the pictures that are being made
        self._changed = asyncio.Event()

    @property
    def part(self) -> float:
        """What is done of all, 0 to 1."""
        return (len(self.kept) + sum(self._parts.values())) / len(self.jobs)

    @property
    def bytes(self) -> int:
        """What its finished pictures take."""
        return sum(kept.bytes for kept in self.kept.values())

    def tell(self, number: int, part: float) -> None:
        """So much of a picture is done."""
        self.state = "running"
        self._parts[number] = part
        self._change()

    def keep(self, number: int, kept: Kept) -> None:
        """A picture is done."""
        self._parts.pop(number, None)
        self.kept[number] = kept
        self._change()

    def end(self, state: JobState, problem: ProblemError | None = None) -> None:
        """Nothing more will happen, unless it ended before."""
        if self.finished is None:
            self.state, self.problem, self.finished = state, problem, time.time()
            self._parts.clear()
            self._change()

    def _change(self) -> None:
        self._changed.set()
        self._changed = asyncio.Event()

    async def changes(self, idle_s: float) -> AsyncIterator[bool]:
        """Once now and after each change until it has ended; False after so long without one."""
        news = True
        while True:
            changed, ended = self._changed, self.finished is not None
            yield news
            if ended:
                return
            try:
                async with asyncio.timeout(idle_s):
                    news = await changed.wait()
            except TimeoutError:
                news = False


class JobStore:
    """Jobs below a folder, their pictures in ``<id>/<number>``; none outlives the server.

    So many jobs and bytes of pictures are kept, each for so long after its end; what ended first
    goes first.
    """

    def __init__(self, folder: Path, settings: Settings, pool: Pool, scenes: SceneStore) -> None:
        self._folder, self._settings, self._pool, self._scenes = folder, settings, pool, scenes
        shutil.rmtree(folder, ignore_errors=True)  # of a server that was ended
        folder.mkdir(parents=True)
        self._jobs: dict[str, StoredJob] = {}
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self._keys: dict[Key, tuple[tuple[str, ...], str]] = {}  # what was asked, and the job
        self._lanes = asyncio.Semaphore(pool.background_lanes)

    def all(self) -> list[StoredJob]:
        """All of them, the newest first."""
        return list(reversed(self._jobs.values()))

    def get(self, job_id: str) -> StoredJob:
        """The job of an id. Raises ProblemError 404."""
        try:
            return self._jobs[job_id]
        except KeyError:
            raise ProblemError(
                404, f"job '{job_id[:100]}': unknown; it may have expired", "job"
            ) from None

    async def create(self, jobs: Sequence[Job], key: Key | None = None) -> StoredJob:
        """Begin to make pictures; the job that an Idempotency-Key has made already.

        Raises ProblemError 422 for a key that stands for other pictures, 429 when there are too
        many jobs.
        """
        # A thousand with displays of their own take 0.1 s to tell apart.
        asked = await asyncio.to_thread(lambda: tuple(job.key for job in jobs)) if key else ()
        if key and key in self._keys:
            before, job_id = self._keys[key]
            if before != asked:
                raise ProblemError(
                    422, "Idempotency-Key: stands for other pictures; take another",
                    "Idempotency-Key",
                )  # fmt: skip
            return self._jobs[job_id]
        if len(self._jobs) >= self._settings.max_jobs and not self._drop_oldest():
            raise ProblemError(
                429, f"{len(self._jobs)} jobs are being done; ask again in 10 s", None,
                {"Retry-After": "10"},
            )  # fmt: skip
        stored = StoredJob(jobs, self._folder)
        self._jobs[stored.id] = stored
        if key is not None:
            self._keys[key] = asked, stored.id
        leases = ExitStack()
        for scene in {job.scene.id for job in jobs if job.scene}:
            leases.enter_context(self._scenes.source(scene))
        task = asyncio.create_task(self._do(stored), name=f"job {stored.id}")
        task.add_done_callback(lambda _: leases.close())
        self._tasks[stored.id] = task
        return stored

    def delete(self, job_id: str) -> None:
        """Call a job off and forget it. Raises ProblemError 404."""
        self._forget(self.get(job_id))

    async def close(self) -> None:
        """Call off all jobs."""
        tasks = list(self._tasks.values())
        for stored in self.all():
            self._forget(stored)
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _do(self, stored: StoredJob) -> None:
        numbers = iter(range(len(stored.jobs)))
        try:
            stored.folder.mkdir()
            async with asyncio.TaskGroup() as lanes:
                for _ in range(self._pool.background_lanes):
                    lanes.create_task(self._lane(stored, numbers))
        except* Exception as errors:
            error = errors.exceptions[0]
            if as_problem(error).status_code == 500:
                _log.error("job failed", extra={"job": stored.id}, exc_info=error)
            stored.end("failed", as_problem(error))
        else:
            stored.end("done")
        finally:
            stored.end("cancelled")
            self._tasks.pop(stored.id, None)
        if stored.id in self._jobs:
            loop = asyncio.get_running_loop()
            stored.expiry = loop.call_later(self._settings.job_keep_s, self._forget, stored)

    async def _lane(self, stored: StoredJob, numbers: Iterator[int]) -> None:
        for number in numbers:
            async with self._lanes:  # in turns with other jobs
                await self._make(stored, number)

    async def _make(self, stored: StoredJob, number: int) -> None:
        job = stored.jobs[number]
        stored.tell(number, 0.0)
        result = await self._pool.run(
            job,
            deadline_s=self._settings.job_deadline_s,
            progress=lambda part: stored.tell(number, part),
            background=True,
        )
        picture = Picture.of(job, result)
        self._make_room(stored, len(picture.body))
        file = stored.folder / str(number)
        writing = asyncio.create_task(asyncio.to_thread(_write, file, picture.body))
        try:
            await asyncio.shield(writing)
        finally:
            await asyncio.wait((writing,))  # or it would write into a folder that goes
        headers = picture.headers | {"ETag": f'"{self._pool.tag(job)}"', "Content-Type": job.media}
        stored.keep(number, Kept(file, len(picture.body), headers))

    def _make_room(self, stored: StoredJob, count: int) -> None:
        """Drop what ended first until so many bytes more may be kept."""
        limit = self._settings.job_results_mb << 20
        while sum(job.bytes for job in self._jobs.values()) + count > limit:
            if not self._drop_oldest():
                raise ProblemError(
                    507, f"pictures: more than {limit} bytes of them; ask for fewer at a time",
                    "pictures",
                )  # fmt: skip

    def _drop_oldest(self) -> bool:
        ended = [job for job in self._jobs.values() if job.finished is not None]
        if not ended:
            return False
        self._forget(min(ended, key=lambda job: job.finished or 0.0))
        return True

    def _forget(self, stored: StoredJob) -> None:
        if self._jobs.pop(stored.id, None) is None:
            return
        self._keys = {k: v for k, v in self._keys.items() if v[1] != stored.id}
        if stored.expiry:
            stored.expiry.cancel()  # which else would hold it in memory until then
        stored.end("cancelled")
        task = self._tasks.pop(stored.id, None)
        if task is None:
            shutil.rmtree(stored.folder, ignore_errors=True)
        else:
            task.add_done_callback(lambda _: shutil.rmtree(stored.folder, ignore_errors=True))
            task.cancel()


def _write(file: Path, body: memoryview) -> None:
    """Write a file that is there whole or not at all. Raises ProblemError 507."""
    partial = file.with_suffix(".partial")
    try:
        partial.write_bytes(body)
        partial.rename(file)
    except OSError as error:
        with suppress(OSError):
            partial.unlink()
        raise ProblemError(
            507, f"the picture cannot be kept: {error.strerror}; ask again later"
        ) from error

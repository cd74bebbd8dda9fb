"""Jobs as they are kept, without a server or a render process."""

import asyncio
import gc
import threading
import weakref
from functools import cached_property
from pathlib import Path
from typing import Any

import pytest
from lfd_render.service.job_store import JobStore, StoredJob
from lfd_render.service.problems import ProblemError
from lfd_render.service.settings import Settings

from lfd_render.display import DisplayProfile
from lfd_render.engine import encoding
from lfd_render.engine.jobs import Job, Result, ViewMap

JOB = Job(ViewMap(), encoding.PNG, None, DisplayProfile.load("gavane-2024-tilted-4k"))


class Maker:
    """Stands for the pool."""

    background_lanes = 1

    async def run(self, job: Job, **_: object) -> Result:
        return Result(b"picture", job.media, {"size": [1, 1]})

    def tag(self, job: Job) -> str:
        return "tag"


def store(folder: Path, keep_s: float) -> JobStore:
    made: Any = Maker()
    scenes: Any = None  # maps are of none
    return JobStore(folder / "jobs", Settings(job_keep_s=keep_s), made, scenes)


async def ended(stored: StoredJob) -> None:
    async for _ in stored.changes(5):
        pass
    await asyncio.sleep(0)


def test_a_job_expires(tmp_path: Path) -> None:
    async def main() -> None:
        jobs = store(tmp_path, 0.2)
        stored = await jobs.create([JOB])
        await ended(stored)
        assert jobs.get(stored.id) is stored
        assert (stored.folder / "0").read_bytes() == b"picture"
        await asyncio.sleep(0.4)
        with pytest.raises(ProblemError, match="expired"):
            jobs.get(stored.id)
        assert not stored.folder.exists()

    asyncio.run(main())


def test_a_deleted_job_is_not_kept_in_memory(tmp_path: Path) -> None:
    """Until it would have expired, that is."""

    async def main() -> None:
        jobs = store(tmp_path, 3600)
        stored = await jobs.create([JOB])
        await ended(stored)
        jobs.delete(stored.id)
        left = weakref.ref(stored)
        del stored
        gc.collect()
        assert left() is None

    asyncio.run(main())


def test_pictures_are_told_apart_beside_the_loop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And only where an Idempotency-Key asks for it: a thousand take 0.1 s."""
    threads = set()

    def key(job: Job) -> str:
        threads.add(threading.current_thread())
        return "key"

    told = cached_property(key)
    told.__set_name__(Job, "key")
    monkeypatch.setattr(Job, "key", told)

    async def main() -> None:
        jobs = store(tmp_path, 3600)
        fresh = Job(JOB.product, JOB.media, None, JOB.display)
        await jobs.create([fresh])
        assert not threads
        await jobs.create([fresh], ("somebody", "turn"))
        assert threads
        assert threading.main_thread() not in threads
        await jobs.close()

    asyncio.run(main())

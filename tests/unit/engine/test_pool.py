"""What the queue does without any render process."""

import asyncio
import errno
from typing import Any

import pytest

from lfd_render.display import DisplayProfile
from lfd_render.engine import encoding, pool
from lfd_render.engine.jobs import Job, Ready, ViewMap
from lfd_render.engine.pool import Pool, PoolSettings


class Process:
    """Stands for a render process."""

    renderer: str | None = None
    software = False


def test_a_tag_names_what_renders() -> None:
    job = Job(ViewMap(), encoding.PNG, None, DisplayProfile.load("gavane-2024-tilted-4k"))
    pools = [Pool(PoolSettings()) for _ in range(3)]
    for each, name in zip(pools, ("llvmpipe", "llvmpipe", "GeForce"), strict=True):
        process: Any = Process()
        each._busy[process] = None
        each._heard(process, Ready(name, software=False))
    one, same, other = (each.tag(job) for each in pools)
    assert one == same != other


def test_what_keeps_descriptors_is_let_go_of_where_a_process_wants_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    kept = ["a picture"]

    def start(*_: object) -> None:
        if kept:
            raise OSError(errno.EMFILE, "Too many open files")
        started.set_result(None)

    async def main() -> None:
        nonlocal started
        started = asyncio.get_running_loop().create_future()
        monkeypatch.setattr(pool, "RenderProcess", start)
        monkeypatch.setattr(pool, "_LACK_S", 0.01)
        Pool(PoolSettings(), kept.clear)._spawn_if_possible()
        async with asyncio.timeout(5):
            await started

    started: asyncio.Future[None]
    asyncio.run(main())

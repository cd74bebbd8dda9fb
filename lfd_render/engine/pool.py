"""A bounded queue before a few render processes, for an asyncio program."""

from __future__ import annotations

import asyncio
import hashlib
import logging
import signal
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import lfd_render.errors
from lfd_render.engine.jobs import Cancel, Done, Failed, Forget, Job, NotReady, Ready, Result, Work
from lfd_render.engine.jobs import Progress as Told
from lfd_render.engine.plans import encoding_seconds
from lfd_render.engine.process import RenderProcess
from lfd_render.engine.worker import WorkerConfig
from lfd_render.errors import (
    BusyError,
    CancelledError,
    DeadlineError,
    GpuError,
    LfdError,
    PoisonError,
    UnavailableError,
)

_log = logging.getLogger(__name__)

_WATCH_S = 0.1
_MOST_DEATHS = 2  # of processes at a scene or an order, before it is refused
_REFUSED_S = 3600.0  # how long a death counts
_MOST_KILLS = 4  # of processes at a job by others, before it is given up
_PATIENCE_S = 1.0  # how long the first in the queue lets others go where their scene is warm
_QUIET_S = 2.0  # nobody asks for so long before the only process turns to the background
_MOST_WAIT_S = 60.0  # between later ones
_LACK_S = 1.0  # between tries to start a process while there are no file descriptors or memory
_MOST_FAILED_STARTS = 3  # in a row, until which a new process is tried at once


@dataclass(frozen=True)
class PoolSettings:
    """processes: how many render at once. queue: jobs that may wait. deadline_s: what a job may
    take unless it says otherwise, waiting included. grace_s: how long a process may go on after
    that before it is ended. worker: each process's own."""

    processes: int = 1
    queue: int = 32
    deadline_s: float = 60.0
    grace_s: float = 5.0
    worker: WorkerConfig = field(default_factory=WorkerConfig)


class InternalError(Exception):
    """A job ended in an error that nobody expected; its trace is in the log."""


@dataclass(eq=False)
class _Ticket:
    """A job on its way."""

    number: int
    job: Job
    answer: asyncio.Future[Result]
    deadline: float  # on the monotonic clock
    submitted: float
    started: float = 0.0
    kills: int = 0
    progress: Callable[[float], None] | None = None
    background: bool = False
    yields: bool = False  # called off for the sake of others, to be done again


class Pool:
    """Render processes, each with one context for life, and the jobs that wait for them.

    A job goes to the process that has most of what it needs. It is done again when its process
    dies. A scene at which processes die twice is refused for an hour; where we end them, since they
    hang or grow too large, that order alone is. Jobs in the background leave one process to the
    others; where there is but one, they give way, and are begun again in a lull.
    """

    def __init__(self, settings: PoolSettings, shed: Callable[[], None] = lambda: None) -> None:
        """shed: lets go of what keeps file descriptors and can be made again."""
        self.settings = settings
        self._shed = shed
        self.counts: Counter[str] = Counter()  # jobs by outcome, and restarts
        self._busy: dict[RenderProcess, _Ticket | None] = {}
        self._waiting: list[_Ticket] = []
        self._deaths: dict[str, list[float]] = {}  # when, by a scene's id or an order's key
        self._made_by: set[str] = set()  # the GL renderers there have been
        self._number = 0
        self._failed_starts = 0
        self._trouble = ""
        self._draining = False
        self._mean_s = 1.0  # of a job
        self._asked = -_QUIET_S  # when there last was a job that is not in the background
        self._watch: asyncio.Task[None] | None = None
        self._changed = asyncio.Event()

    async def start(self) -> None:
        """Start the processes and wait until all are ready. Raises GpuError if one cannot be."""
        for _ in range(self.settings.processes):
            self._spawn()
        self._watch = asyncio.create_task(self._watch_over(), name="watch")
        while not all(process.renderer for process in self._busy):
            if self._trouble:
                await self.close()
                raise GpuError(self._trouble)
            await self._change()

    async def run(
        self,
        job: Job,
        *,
        deadline_s: float | None = None,
        progress: Callable[[float], None] | None = None,
        background: bool = False,
    ) -> Result:
        """The job's result, with the milliseconds it waited as `queue` in its timings.

        A job in the background waits for all others; its caller bounds how many there are.
        Cancelling the caller calls the job off. Raises BusyError when the queue is full,
        DeadlineError, PoisonError, UnavailableError, InternalError, and the job's own errors.
        """
        self._check(job, background)
        now = time.monotonic()
        seconds = self.settings.deadline_s if deadline_s is None else deadline_s
        self._number += 1
        ticket = _Ticket(
            self._number, job, asyncio.get_running_loop().create_future(), now + seconds, now,
            progress=progress, background=background,
        )  # fmt: skip
        self._waiting.append(ticket)
        self._dispatch()
        try:
            async with asyncio.timeout(seconds):
                result = await ticket.answer
        except TimeoutError:
            self.counts["late"] += 1
            raise DeadlineError(
                f"took longer than {seconds:g} s; ask for fewer or smaller views, or again later"
            ) from None
        except asyncio.CancelledError:
            self.counts["cancelled"] += 1
            raise
        except Exception:
            self.counts["failed"] += 1
            raise
        finally:
            self._leave(ticket)
        self.counts["done"] += 1
        result.timings_ms["queue"] = round(1000 * (ticket.started - ticket.submitted), 3)
        return result

    def tag(self, job: Job) -> str:
        """What names the bytes of a job's answer: its key, and the GL renderers that may make
        it."""
        renderers = repr(sorted(self._made_by)).encode()
        return f"{job.key}-{hashlib.sha256(renderers).hexdigest()[:8]}"

    def forget(self, scene: str) -> None:
        """Let all processes drop a scene."""
        for process in self._busy:
            process.send(Forget(scene))

    async def drain(self, seconds: float) -> None:
        """Take no more jobs, and wait so long for those that were taken."""
        self._draining = True
        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                while self._waiting or any(self._busy.values()):
                    await self._change()

    async def close(self) -> None:
        """End the processes."""
        self._draining = True
        if self._watch:
            self._watch.cancel()
        processes = list(self._busy)
        self._busy.clear()
        for process in processes:
            await asyncio.to_thread(process.close)
        for ticket in self._waiting:
            self._fail(ticket, UnavailableError("the server is going down; ask again"))

    @property
    def queued(self) -> int:
        """Jobs that wait."""
        return len(self._waiting)

    @property
    def running(self) -> int:
        """Jobs that are being done."""
        return sum(ticket is not None for ticket in self._busy.values())

    @property
    def ready(self) -> int:
        """Processes that have their context."""
        return sum(process.renderer is not None for process in self._busy)

    @property
    def renderers(self) -> list[str]:
        """The GL renderers of the processes that are ready."""
        return [process.renderer for process in self._busy if process.renderer]

    @property
    def software(self) -> bool:
        """Whether any process renders without a graphics card."""
        return any(process.software for process in self._busy)

    @property
    def background_lanes(self) -> int:
        """How many jobs in the background are done at once."""
        return max(1, self.settings.processes - 1)

    @property
    def accepting(self) -> bool:
        """Whether a job would be taken and done."""
        return not self._draining and self.ready > 0

    @property
    def pids(self) -> list[int]:
        """The processes' numbers with the operating system."""
        return [process.pid for process in self._busy]

    @property
    def resident_bytes(self) -> list[int]:
        """What each process occupies."""
        return [process.resident_bytes() for process in self._busy]

    @property
    def blocked(self) -> list[str]:
        """Scenes and orders that are refused."""
        return [blamed for blamed in self._deaths if self._died(blamed) >= _MOST_DEATHS]

    def _check(self, job: Job, background: bool) -> None:
        if self._draining:
            raise UnavailableError("the server is going down; ask again")
        if job.scene and self._deaths:
            for blamed, remedy in ((job.scene.id, "another scene"), (job.key, "other options")):
                if self._died(blamed) >= _MOST_DEATHS:
                    raise PoisonError(
                        f"{job.scene.name}: ended {_MOST_DEATHS} render processes and is refused; "
                        f"give {remedy}"
                    )
        waiting = sum(not ticket.background for ticket in self._waiting)
        if waiting >= self.settings.queue and not background:
            self.counts["refused"] += 1
            ahead = self._mean_s * (waiting + 1) / self.settings.processes
            wait_s = max(1, round(ahead))
            raise BusyError(f"{waiting} pictures are waiting; ask again in {wait_s} s", wait_s)

    def _spawn(self) -> None:
        self._busy[RenderProcess(self.settings.worker, self._heard, self._ended)] = None

    def _dispatch(self) -> None:
        """Give waiting jobs to idle processes."""
        while self._waiting:
            candidates = self._candidates()
            idle = [p for p, ticket in self._busy.items() if p.renderer and ticket is None]
            if not idle:
                self._make_way(candidates)
            if not idle or not candidates:
                return
            process, ticket = self._match(idle, candidates)
            self._waiting.remove(ticket)
            ticket.started = time.monotonic()
            self._busy[process] = ticket
            process.send(Work(ticket.number, ticket.job))

    def _candidates(self) -> list[_Ticket]:
        """The jobs of which one goes next: those in the background when no others wait, and as
        long as they keep none waiting."""
        waiting = [ticket for ticket in self._waiting if not ticket.background]
        running = sum(ticket is not None and ticket.background for ticket in self._busy.values())
        lull = len(self._busy) > 1 or time.monotonic() - self._asked > _QUIET_S
        return waiting or (self._waiting if lull and running < self.background_lanes else [])

    def _make_way(self, candidates: list[_Ticket]) -> None:
        """Call off a job in the background if nothing else runs that the candidates could await."""
        running = [(p, ticket) for p, ticket in self._busy.items() if ticket]
        if any(not ticket.background or ticket.yields for _, ticket in running):
            return
        if running and any(not ticket.background for ticket in candidates):
            process, ticket = running[0]
            ticket.yields = True
            process.send(Cancel(ticket.number))

    def _match(
        self, idle: list[RenderProcess], candidates: list[_Ticket]
    ) -> tuple[RenderProcess, _Ticket]:
        """The job that goes next and the process it goes to: the first, unless one behind it finds
        its scene warm and the first has not waited long; of equal processes the one that has
        idled longest."""
        first = candidates[0]
        patient = time.monotonic() - first.submitted < _PATIENCE_S
        candidates = candidates if patient else [first]
        return max(
            ((process, ticket) for ticket in candidates for process in idle),
            key=lambda pair: (
                _warmth(pair[0], pair[1].job), -pair[1].submitted, -pair[0].idle_since,
            ),
        )  # fmt: skip

    def _heard(self, process: RenderProcess, message: Any) -> None:
        if process not in self._busy:
            return
        match message:
            case Ready():
                process.renderer, process.software = message.renderer, message.software
                self._made_by.add(message.renderer)
                self._failed_starts = 0
                self._dispatch()
            case NotReady():
                self._trouble = message.message
            case Told():
                ticket = self._busy[process]
                if ticket and ticket.number == message.number and ticket.progress:
                    ticket.progress(message.part)
            case Done() | Failed():
                self._answered(process, message)
        self._changed.set()

    def _answered(self, process: RenderProcess, message: Done | Failed) -> None:
        ticket, self._busy[process] = self._busy[process], None
        process.idle_since = time.monotonic()
        if message.holds:
            process.holds = message.holds
        if ticket is not None:
            assert ticket.number == message.number
            taken = time.monotonic() - ticket.started
            if not ticket.background:
                self._mean_s += 0.1 * (taken - self._mean_s)
            yielded, ticket.yields = ticket.yields, False
            if yielded and _called_off(message) and not ticket.answer.done():
                self._waiting.append(self._renumbered(ticket))
            elif isinstance(message, Failed):
                self._fail(ticket, _error(message))
            elif not ticket.answer.done():
                ticket.answer.set_result(message.result)
        self._dispatch()

    def _ended(self, process: RenderProcess) -> None:
        """A process has died: start another, and do its job again unless the job is to blame."""
        if process not in self._busy:
            return
        ticket = self._busy.pop(process)
        self.counts["restarts"] += 1
        _log.warning(
            "render process ended",
            extra={"pid": process.pid, "returncode": process.returncode, "scene": _scene(ticket)},
        )
        if process.renderer is None:
            self._failed_starts += 1
            self._trouble = self._trouble or "a render process ended while it started"
        if self._draining and not self._waiting and ticket is None:
            return
        if self._failed_starts < _MOST_FAILED_STARTS:
            self._spawn_if_possible()
        else:
            wait_s = min(2.0**self._failed_starts / 4, _MOST_WAIT_S)
            asyncio.get_running_loop().call_later(wait_s, self._spawn_later)
        if ticket is not None:
            self._mourn(process, ticket)
        self._changed.set()

    def _renumbered(self, ticket: _Ticket) -> _Ticket:
        """The ticket under a number that has not been called off."""
        self._number += 1
        ticket.number = self._number
        return ticket

    def _spawn_later(self) -> None:
        if not self._draining and len(self._busy) < self.settings.processes:
            self._spawn_if_possible()

    def _spawn_if_possible(self) -> None:
        """Start a process, or try again later where the machine lacks what it takes."""
        try:
            self._spawn()
        except OSError as error:
            _log.error("no render process can be started", extra={"why": str(error)})
            self._shed()
            asyncio.get_running_loop().call_later(_LACK_S, self._spawn_later)

    def _mourn(self, process: RenderProcess, ticket: _Ticket) -> None:
        """Decide what becomes of a dead process's job."""
        scene = ticket.job.scene
        ticket.kills += 1
        # SIGKILL comes from us or for want of memory, maybe by the fault of the order; what is not
        # ours says nothing until it happens again and again. All else is the scene's fault.
        killed = process.returncode == -signal.SIGKILL
        blamed = ticket.job.key if killed or scene is None else scene.id
        if process.condemned or not killed:
            self._deaths.setdefault(blamed, []).append(time.monotonic())
        elif ticket.kills >= _MOST_KILLS:
            self._deaths[blamed] = [time.monotonic()] * _MOST_DEATHS
        if scene is None and ticket.kills >= _MOST_DEATHS:
            self._fail(ticket, InternalError(f"{ticket.kills} processes ended over it"))
        elif scene and self._died(blamed) >= _MOST_DEATHS:
            self._fail(
                ticket,
                PoisonError(
                    f"{scene.name}: rendering it so ends the process; give other options or "
                    "another scene"
                ),
            )
        elif not ticket.answer.done():
            ticket.yields = False
            self._waiting.insert(0, ticket)
            self._dispatch()

    def _died(self, blamed: str) -> int:
        """How many processes died of it lately."""
        since = time.monotonic() - _REFUSED_S
        return sum(when > since for when in self._deaths.get(blamed, ()))

    def _fail(self, ticket: _Ticket, error: Exception) -> None:
        if not ticket.answer.done():
            ticket.answer.set_exception(error)

    def _leave(self, ticket: _Ticket) -> None:
        """Nobody waits for this ticket any more."""
        if ticket in self._waiting:
            self._waiting.remove(ticket)
        for process, running in self._busy.items():
            if running is ticket:
                process.send(Cancel(ticket.number))
        if not ticket.background:
            self._asked = time.monotonic()
        self._changed.set()

    async def _watch_over(self) -> None:
        """End processes that hang or grow too large."""
        limit = self.settings.worker.memory_bytes
        while True:
            await asyncio.sleep(_WATCH_S)
            self._dispatch()  # what waited for a lull
            now = time.monotonic()
            for process, ticket in self._busy.items():
                late = ticket is not None and self._hangs(ticket, now)
                large = limit and process.resident_bytes() > limit
                if (late or large) and not process.condemned:
                    _log.warning(
                        "render process is ended",
                        extra={"pid": process.pid, "why": "hangs" if late else "too large"},
                    )
                    process.condemn()

    def _hangs(self, ticket: _Ticket, now: float) -> bool:
        # A job that waited long, or for an impatient client, has its time none the less.
        most = max(ticket.deadline, ticket.started + self.settings.deadline_s)
        late_s = now - most - self.settings.grace_s
        # An encoder says nothing while it works.
        return late_s > 0 and late_s > encoding_seconds(ticket.job)

    async def _change(self) -> None:
        """Wait until something has changed."""
        self._changed.clear()
        await self._changed.wait()


def _warmth(process: RenderProcess, job: Job) -> int:
    """How much of what a job needs a process has: 3 the finished panel image, 2 the stage, 1 the
    parsed scene."""
    holds = process.holds
    if job.frame_key in holds.frames:
        return 3
    if job.stage_key == holds.stage:
        return 2
    return int(job.scene is not None and job.scene.id in holds.scenes)


def _scene(ticket: _Ticket | None) -> str | None:
    return ticket.job.scene.id if ticket and ticket.job.scene else None


def _called_off(message: Done | Failed) -> bool:
    return isinstance(message, Failed) and message.kind == CancelledError.__name__


def _error(failed: Failed) -> Exception:
    """The error that a process met."""
    if failed.trace is not None:
        _log.error("job failed", extra={"trace": failed.trace})
        return InternalError(failed.arguments[0])
    kind: type[LfdError] = getattr(lfd_render.errors, failed.kind, LfdError)
    return kind(*failed.arguments)

"""Sequences on a Ray cluster: actors with one renderer each, which may die and are made anew.

Frames are idempotent, so a task whose actor or node died is simply done again. Where the driver
writes to a folder their bytes come back to it; to a URL the actors write themselves.
"""

from __future__ import annotations

import importlib.util
import logging
import os
import secrets
import socket
import sys
from collections.abc import Iterable, Iterator
from contextlib import redirect_stdout, suppress
from dataclasses import replace
from itertools import islice
from types import TracebackType
from typing import Any, Self

from lfd_render.engine.frame_store import put_object
from lfd_render.engine.jobs import Job, Result
from lfd_render.engine.sequence import Sequence
from lfd_render.engine.worker import WorkerConfig
from lfd_render.engine.workshop import Workshop
from lfd_render.errors import GpuError, LfdError, OptionError
from lfd_render.gpu.system import egl_index_of_cuda
from lfd_render.renderer import Renderer
from lfd_render.version import __version__

_CONNECT_S = 5.0
_START_S = 120.0  # until all actors have their context
_RETRIES = 5  # of a frame whose actor died
_AHEAD = 2  # frames an actor has before it, so that it does not wait for the driver
_CLIENT_PORT = 10001
_START = "start a cluster with 'ray start --head --ray-client-server-port=10001'"


class Painter:
    """The actor: one renderer for life."""

    def __init__(self, device: str) -> None:
        config = WorkerConfig(_egl_device(device))
        self._renderer = Renderer(config.device)
        self._workshop = Workshop(self._renderer, config.scene_bytes, 0)

    def about(self) -> tuple[str, str]:
        """The program's version and the GL renderer."""
        return __version__, self._renderer.device.name

    def make(self, job: Job, url: str | None, name: str) -> Result:
        """The job's result, its body written below the URL if there is one."""
        result = self._workshop.make(job, lambda _: None)
        if url is None or not result.body:
            return replace(result, body=bytes(result.body))
        sha256 = put_object(url, name, result.body)
        return replace(result, body=b"", report=result.report | {"sha256": sha256})


class RayEngine:
    """Actors on the cluster at an address, by default that of RAY_ADDRESS, else one of its own on
    this machine. processes: how many actors; None: as many as fit. Raises OptionError, GpuError."""

    def __init__(
        self,
        address: str | None,
        device: str,
        processes: int | None,
        url: str | None,
        sequence: Sequence,
    ) -> None:
        if importlib.util.find_spec("ray") is None:
            raise OptionError(
                "engine", "ray is not installed; pip install 'lfd-render[ray]', or take local"
            )
        self._address = address or os.environ.get("RAY_ADDRESS")
        self._device, self._processes = device, processes
        self._url, self._sequence = url, sequence
        self._actors: list[Any] = []
        self._renderers: set[str] = set()
        self._aside = redirect_stdout(sys.stderr)  # where Ray tells of actors that died

    def __enter__(self) -> Self:
        if self._address:
            _check_reachable(self._address)
        else:
            _lock_up()
        ray = _ray()

        where = self._address or "local"
        self._aside.__enter__()
        try:
            ray.init(
                where,
                include_dashboard=False if not self._address else None,
                log_to_driver=False,
                logging_level=logging.ERROR,
            )
        except Exception as error:  # connection, version and token errors have no common class
            self._aside.__exit__(None, None, None)
            reason = " ".join(str(error).split())[:300]
            raise OptionError(
                "engine",
                f"'{where}': no Ray there that knows the token of RAY_AUTH_TOKEN: {reason}",
            ) from error
        try:
            self._start()
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
        actors = f"{len(self._actors)} Ray actor{'s' if len(self._actors) > 1 else ''}"
        return f"{actors} on {', '.join(sorted(self._renderers))}"

    def facts(self, job: Job) -> dict[str, Any]:
        """What the scene holds; all actors load it at once. Raises the job's errors."""
        tasks = [actor.make.remote(job, None, "") for actor in self._actors]
        return next(_got(task).report for task in tasks)

    def results(self, jobs: Iterable[tuple[int, Job]]) -> Iterator[tuple[int, Result]]:
        """Results under the numbers of their jobs, as they come. Raises the jobs' errors."""
        ray = _ray()

        jobs = iter(jobs)
        running: dict[Any, tuple[Any, int]] = {}  # task → actor and number
        for actor in self._actors * _AHEAD:
            self._give(actor, jobs, running)
        while running:
            (task, *_), _ = ray.wait(list(running))
            actor, number = running.pop(task)
            self._give(actor, jobs, running)
            yield number, _got(task)

    def _end(self) -> None:
        ray = _ray()

        for actor in self._actors:
            with suppress(Exception):
                ray.kill(actor)
        ray.shutdown()
        self._aside.__exit__(None, None, None)

    def _give(
        self, actor: Any, jobs: Iterator[tuple[int, Job]], running: dict[Any, tuple[Any, int]]
    ) -> None:
        for number, job in islice(jobs, 1):
            task = actor.make.remote(job, self._url, self._sequence.name(number))
            running[task] = actor, number

    def _start(self) -> None:
        """Make the actors, and wait until each has its context."""
        ray = _ray()

        resources = ray.cluster_resources()
        gpus = 0 if self._device == "software" else int(resources.get("GPU", 0))
        cores = int(resources.get("CPU", 1))
        count = self._processes or (2 * gpus if gpus else max(1, cores // 2))
        # Two actors share a GPU: while one reads back and encodes, the other renders.
        options: dict[str, Any] = {"num_cpus": min(1.0, cores / count)}
        if gpus:
            options["num_gpus"] = min(0.5, gpus / count)
            # EGL knows devices by their numbers of the whole machine.
            keep = {"RAY_EXPERIMENTAL_NOSET_CUDA_VISIBLE_DEVICES": "1"}
            options["runtime_env"] = {"env_vars": keep | {"CUDA_DEVICE_ORDER": "PCI_BUS_ID"}}
        actor = ray.remote(Painter).options(max_restarts=-1, max_task_retries=_RETRIES, **options)
        self._actors = [actor.remote(self._device) for _ in range(count)]
        tasks = [actor.about.remote() for actor in self._actors]
        ready, late = ray.wait(tasks, num_returns=count, timeout=_START_S)
        if late:
            raise GpuError(
                f"Ray: {len(late)} of {count} actors did not start within {_START_S:g} s; the "
                f"cluster has {cores} cores and {gpus} GPUs, give fewer --processes"
            )
        for version, renderer in map(_got, ready):
            if version != __version__:
                raise GpuError(
                    f"Ray: a node has lfd_render {version}, this machine {__version__}; "
                    "install the same on all"
                )
            self._renderers.add(renderer)


def _ray() -> Any:
    """The extra, which reads how it is locked up when it is imported."""
    import ray  # noqa: PLC0415

    return ray


def _got(task: Any) -> Any:
    """What a task gave. Raises the error that it met, as it was there."""
    ray = _ray()

    try:
        return ray.get(task)
    except ray.exceptions.RayTaskError as error:
        if isinstance(error.cause, LfdError):
            raise error.cause from None
        raise
    except ray.exceptions.RayActorError as error:
        if cause := _in_constructor(error):
            raise cause from None
        raise GpuError(
            f"Ray: an actor died {_RETRIES + 1} times over a frame, or its node cannot render: "
            f"{' '.join(str(error).split())[-300:]}"
        ) from error


def _in_constructor(error: BaseException) -> LfdError | None:
    """The error for which an actor could not be made."""
    cause = getattr(error, "cause", None) or error.__cause__
    return cause if isinstance(cause, LfdError) else None


def _egl_device(device: str) -> str:
    """The EGL device of the GPU that Ray gave this actor; as asked for where it gave none."""
    ray = _ray()

    given = ray.get_runtime_context().get_accelerator_ids().get("GPU", [])
    if not given or device not in ("auto", "gpu"):
        return device
    index = egl_index_of_cuda(int(given[0]))
    if index is None:
        raise GpuError(
            f"Ray: GPU {given[0]} is no EGL device of its node; give its container "
            "NVIDIA_DRIVER_CAPABILITIES=graphics,compute,utility"
        )
    return str(index)


def _lock_up() -> None:
    """Give a cluster of our own a token, since whoever reaches Ray's ports runs code."""
    if "RAY_AUTH_MODE" not in os.environ and "ray" not in sys.modules:
        os.environ["RAY_AUTH_MODE"] = "token"
        os.environ["RAY_AUTH_TOKEN"] = secrets.token_hex(32)


def _check_reachable(address: str) -> None:
    """Raise OptionError where nobody listens: Ray itself would try for long."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if not host and not port.isdecimal():
        host, port = port, str(_CLIENT_PORT)
    if address in ("auto", "local"):
        return
    try:
        socket.create_connection((host or "127.0.0.1", int(port)), _CONNECT_S).close()
    except (OSError, ValueError, OverflowError) as error:
        reason = (isinstance(error, OSError) and error.strerror) or str(error)
        raise OptionError("engine", f"'{address}': nobody answers: {reason}; {_START}") from error

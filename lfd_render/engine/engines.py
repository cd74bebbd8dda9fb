"""What makes the frames of a sequence: this machine's render processes, or a Ray cluster."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from types import TracebackType
from typing import Any, Protocol, Self

from lfd_render.engine.jobs import Job, Result
from lfd_render.engine.local import LocalEngine
from lfd_render.engine.sequence import Sequence
from lfd_render.errors import OptionError
from lfd_render.gpu.system import egl_devices


class Engine(Protocol):
    """Makes results of jobs until it is left."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...

    @property
    def name(self) -> str:
        """Where frames are rendered."""

    def facts(self, job: Job) -> dict[str, Any]:
        """What the scene holds; all that render load it at once. Raises the job's errors."""

    def results(self, jobs: Iterable[tuple[int, Job]]) -> Iterator[tuple[int, Result]]:
        """Results under their numbers, as they come. Raises the jobs' errors. A result without a
        body was written where it was made, with its `sha256` in the report."""


def open_engine(
    text: str, device: str, processes: int | None, url: str | None, sequence: Sequence
) -> Engine:
    """The engine of ``local``, ``ray`` or ``ray://HOST:PORT``. url: where those that render may
    write the sequence's frames themselves. Raises OptionError, GpuError."""
    if text == "local":
        return LocalEngine(device, processes or _processes_for(device))
    if text != "ray" and not text.startswith("ray://"):
        raise OptionError("engine", f"'{text}'; give local, ray or ray://HOST:PORT")

    from lfd_render.engine.ray_engine import RayEngine  # noqa: PLC0415 (an extra)

    return RayEngine(None if text == "ray" else text, device, processes, url, sequence)


def _processes_for(device: str) -> int:
    """Two before a graphics card: while one encodes, the other renders. In software one frame keeps
    all cores busy, and a second process only adds its start."""
    try:
        devices = egl_devices()
    except OSError:
        return 1  # whose start tells what is missing
    hardware = {str(found.index) for found in devices if found.usable and not found.software}
    asked = {device} if device.isdecimal() else hardware
    return 2 if device != "software" and hardware & asked else 1

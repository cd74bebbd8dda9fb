"""What a contender did in a group: a row of the tables, as it is kept in results.jsonl."""

from __future__ import annotations

import statistics
from dataclasses import dataclass, field

from lfd_render.bench.contenders import Contender
from lfd_render.bench.suites import Group
from lfd_render.errors import LfdError

_PANEL_STAGES = ("average", "encode_srgb", "weave")
_POINT_STAGES = ("transform", "sample")


@dataclass
class Row:
    """What one contender did in a group. suites: that show it; gap: why there is nothing, or None;
    fault: what is wrong with its picture. Times in ms, cpu: the processor time of this process;
    memory in bytes; eia: against the panel image's standard, view: against single views' as an eye
    sees them, RMSE in levels of 255; differs: share of pixels in which an application's buffers are
    nobody else's; sweep: as `bench.sweep` has it."""

    group: str
    suites: tuple[str, ...]
    scene: str
    triangles: int
    views: int
    supersample: tuple[int, int]
    contender: str
    technique: str
    aa: str
    application: str = ""
    notation: str = ""
    gap: str | None = None
    fault: str | None = None
    frames_ms: list[float] = field(default_factory=list)
    cpu_ms: list[float] = field(default_factory=list)
    stages_ms: dict[str, float] = field(default_factory=dict)
    leaves_out: str = ""
    compile_ms: float = 0.0
    points: int = 0
    device_bytes: int = 0
    view_size: tuple[int, int] = (0, 0)
    view_rmse: float | None = None
    view_ssim: float | None = None
    detail: float | None = None
    differs: float | None = None
    sweep_flip: float | None = None
    sweep_change: float | None = None
    eia_rmse: float | None = None
    eia_ssim: float | None = None

    @staticmethod
    def of(
        group: Group,
        contender: Contender,
        suites: tuple[str, ...],
        *,
        triangles: int = 0,
        gap: str | None = None,
    ) -> Row:
        """The row of a contender that has done nothing yet, or cannot."""
        return Row(
            group=group.key, suites=suites, scene=group.scene, triangles=triangles,
            views=group.views, supersample=group.supersample, contender=contender.name,
            technique=contender.technique, aa=contender.aa, application=contender.application,
            notation=contender.notation, gap=gap,
        )  # fmt: skip

    @property
    def rasterises(self) -> bool:
        """Whether it is multi-view rasterisation."""
        return self.technique.startswith("mvr")

    @property
    def valid(self) -> bool:
        """Whether its time counts."""
        return self.gap is None and self.fault is None and bool(self.frames_ms)

    @property
    def median_ms(self) -> float:
        """Of the counted frames."""
        return statistics.median(self.frames_ms)

    @property
    def median_cpu_ms(self) -> float:
        """Of the counted frames' processor time, 0 where it is not known."""
        return statistics.median(self.cpu_ms) if self.cpu_ms else 0.0

    def times_faster(self, other: Row) -> float:
        """The other's least time over its own: what else a machine does only adds to a frame, and
        of all estimates this one is found again best (docs/performance.md)."""
        return min(other.frames_ms) / min(self.frames_ms)

    def times_faster_by_cpu(self, other: Row) -> float | None:
        """The same of processor time; None where one's is not known."""
        if not (self.median_cpu_ms and other.median_cpu_ms):
            return None
        return min(other.cpu_ms) / min(self.cpu_ms)

    @property
    def spread(self) -> float:
        """Half the interquartile range over the median."""
        if len(self.frames_ms) < 2:
            return 0.0
        low, _, high = statistics.quantiles(self.frames_ms, n=4, method="inclusive")
        return 0.5 * (high - low) / self.median_ms

    def stage_ms(self, kind: str) -> float:
        """Of the median frame: ``points`` (0 for rasterisers), ``views`` or ``eia``."""
        parts = {"points": 0.0, "views": 0.0, "eia": 0.0}
        for name, ms in self.stages_ms.items():
            points = name in _POINT_STAGES and not self.rasterises
            parts["points" if points else "eia" if name in _PANEL_STAGES else "views"] += ms
        return parts[kind]


def unmeasured(group: Group, error: LfdError | MemoryError) -> list[Row]:
    """Rows of a group that nobody could do."""
    gap = str(error) or type(error).__name__
    return [
        Row.of(group, contender, suites, gap=gap) for contender, suites in group.contenders.items()
    ]


def best_mvr(rows: list[Row]) -> Row | None:
    """The rasteriser of a group that counts: the fastest whose picture is right."""
    rivals = [row for row in rows if row.rasterises and row.valid]
    return min(rivals, key=lambda row: min(row.frames_ms), default=None)

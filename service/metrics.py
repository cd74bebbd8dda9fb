"""What is counted and timed, for Prometheus."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric

if TYPE_CHECKING:
    from lfd_render.engine.pool import Pool

    from .clients import Slots

MEDIA = "text/plain; version=0.0.4; charset=utf-8"
_SECONDS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30, 60)
STAGES = ("queue", "load", "upload", "compile", "frame", "read", "look", "map", "encode")


class Metrics:
    """One registry an application: none is shared by two in one process."""

    def __init__(self, pool: Pool, streams: Slots) -> None:
        self._registry = CollectorRegistry()
        Gauge("lfd_streams", "Streams being sent.", registry=self._registry).set_function(
            lambda: streams.taken
        )
        self._registry.register(_PoolCollector(pool))
        self.requests = Counter(
            "lfd_requests", "Requests answered.", ["route", "method", "status"],
            registry=self._registry,
        )  # fmt: skip
        self.seconds = Histogram(
            "lfd_request_seconds", "From a request's first byte to its answer's last.", ["route"],
            buckets=_SECONDS, registry=self._registry,
        )  # fmt: skip
        self._stages = Histogram(
            "lfd_stage_seconds", "What pictures' stages take.", ["stage"],
            buckets=_SECONDS, registry=self._registry,
        )  # fmt: skip
        self.cached = Counter(
            "lfd_cached_answers", "Pictures answered without a render process.", ["kind"],
            registry=self._registry,
        )  # fmt: skip

    def observe(self, timings_ms: dict[str, float]) -> None:
        """Count the stages of a picture."""
        for stage in STAGES:
            if stage in timings_ms:
                self._stages.labels(stage).observe(timings_ms[stage] / 1000)

    def text(self) -> bytes:
        """Everything in Prometheus's text format."""
        return generate_latest(self._registry)


class _PoolCollector:
    """Reads the pool when it is asked."""

    def __init__(self, pool: Pool) -> None:
        self._pool = pool

    def collect(self) -> Iterator[Metric]:
        """The pool's figures."""
        pool = self._pool
        yield GaugeMetricFamily("lfd_queue_depth", "Pictures that wait.", pool.queued)
        yield GaugeMetricFamily("lfd_running", "Pictures being made.", pool.running)
        yield GaugeMetricFamily("lfd_processes_ready", "Render processes ready.", pool.ready)
        yield GaugeMetricFamily(
            "lfd_blocked_scenes", "Scenes and orders refused.", len(pool.blocked)
        )
        renderers = GaugeMetricFamily("lfd_gl_renderer", "Processes by renderer.", labels=["name"])
        for name in sorted(set(pool.renderers)):
            renderers.add_metric([name], pool.renderers.count(name))
        yield renderers
        memory = GaugeMetricFamily("lfd_process_resident_bytes", "Memory.", labels=["process"])
        for number, size in enumerate(pool.resident_bytes):
            memory.add_metric([str(number)], size)
        yield memory
        yield CounterMetricFamily(
            "lfd_process_restarts", "Processes that ended.", pool.counts["restarts"]
        )
        jobs = CounterMetricFamily("lfd_jobs", "Pictures by how they ended.", labels=["outcome"])
        for outcome in ("done", "failed", "late", "cancelled", "refused"):
            jobs.add_metric([outcome], pool.counts[outcome])
        yield jobs

"""Plots of results: time against triangles and against views, speed against error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from lfd_render.bench.measure import Row
from lfd_render.bench.tables import scene_name
from lfd_render.display.files import replacing
from lfd_render.errors import UsageError

_MARKERS = "osD^vPX*<>"


def write_plots(folder: Path, rows: Sequence[Row]) -> list[Path]:
    """One SVG a suite that has a plot. Raises UsageError without matplotlib, OutputError."""
    written = []
    for suite, (x, y, labels) in _PLOTS.items():
        found = [row for row in rows if suite in row.suites and row.valid]
        if found:
            path = folder / f"{suite}.svg"
            _write(path, found, x, y, labels, panel=_PANELS.get(suite, scene_name))
            written.append(path)
    return written


def _write(
    path: Path,
    rows: Sequence[Row],
    x: Callable[[Row], float],
    y: Callable[[Row], float],
    labels: tuple[str, str],
    *,
    panel: Callable[[Row], str],
) -> None:
    try:
        from matplotlib.figure import Figure  # noqa: PLC0415 - an optional extra
    except ImportError as cause:
        raise UsageError("plots need matplotlib; install lfd-render[bench]") from cause
    scenes = list(dict.fromkeys(panel(row) for row in rows))
    names = list(dict.fromkeys(row.contender for row in rows))
    figure = Figure(figsize=(4.2 * len(scenes), 4.4), layout="constrained")
    all_axes: Any = figure.subplots(1, len(scenes), squeeze=False)[0]
    for axes, scene in zip(all_axes, scenes, strict=True):
        for index, name in enumerate(names):
            points = sorted(
                (x(row), y(row)) for row in rows if row.contender == name and panel(row) == scene
            )
            if points:
                axes.plot(
                    *zip(*points, strict=True),
                    marker=_MARKERS[index % len(_MARKERS)],
                    color=f"C{index}",
                    label=name,
                )
        axes.set(xscale="log", yscale="log", xlabel=labels[0], ylabel=labels[1], title=scene)
        axes.grid(alpha=0.3, which="both")
    figure.legend(
        *_legend(all_axes), loc="outside lower center", ncols=min(4, len(names)), frameon=False
    )
    with replacing(path) as temporary:
        figure.savefig(temporary, format="svg")


def _family(row: Row) -> str:
    return row.scene.partition("?")[0].removeprefix("builtin:")


def _legend(all_axes: Sequence[Any]) -> tuple[list[Any], list[str]]:
    """Each contender once, wherever it appears first."""
    found: dict[str, Any] = {}
    for axes in all_axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    return list(found.values()), list(found)


def _seconds(row: Row) -> float:
    return row.median_ms / 1000


_PANELS = {"triangles": _family}
_PLOTS: dict[str, tuple[Callable[[Row], float], Callable[[Row], float], tuple[str, str]]] = {
    "triangles": (lambda row: row.triangles, _seconds, ("triangles", "seconds a frame")),
    "views": (lambda row: row.views, _seconds, ("views", "seconds a frame")),
    "error": (
        _seconds,
        lambda row: row.eia_rmse or row.view_rmse or 0.0,
        ("seconds a frame", "RMSE of the panel image, levels of 255"),
    ),
}

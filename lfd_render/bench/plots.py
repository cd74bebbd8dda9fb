"""Plots of results: time against triangles and against views, speed against error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from lfd_render.bench.row import Row
from lfd_render.bench.tables import scene_name
from lfd_render.display.files import replacing
from lfd_render.errors import UsageError

_MARKERS = {(1, 1): "o", (2, 1): "^", (1, 2): ">"}


def write_plots(folder: Path, rows: Sequence[Row], kind: str = "svg") -> list[Path]:
    """One picture a suite that has a plot. Raises UsageError without matplotlib, OutputError."""
    written = []
    for suite, (x, y, labels) in _PLOTS.items():
        found = [row for row in rows if suite in row.suites and row.valid]
        if found:
            path = folder / f"{suite}.{kind}"
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
    names = list(dict.fromkeys(row.technique for row in rows))
    columns = min(2, len(scenes))
    lines = -(-len(scenes) // columns)
    figure = Figure(figsize=(5.0 * columns, 3.6 * lines + 0.9), layout="constrained")
    all_axes: Any = figure.subplots(lines, columns, squeeze=False).ravel()
    for axes in all_axes[len(scenes) :]:
        axes.set_visible(False)
    for axes, scene in zip(all_axes, scenes, strict=False):
        for index, name in enumerate(names):
            of = [row for row in rows if row.technique == name and panel(row) == scene]
            for samples, marker in _MARKERS.items():
                points = sorted((x(row), y(row)) for row in of if row.supersample == samples)
                if points:
                    plain = samples == (1, 1)
                    axes.plot(
                        *zip(*points, strict=True), linestyle="-" if plain else "none",
                        marker=marker, color=f"C{index}", label=name if plain else None,
                    )  # fmt: skip
        axes.set(xscale="log", yscale="log", xlabel=labels[0], ylabel=labels[1], title=scene)
        for axis in (axes.xaxis, axes.yaxis):
            _plain_numbers(axis)
        axes.grid(alpha=0.3)
    figure.legend(*_legend(all_axes), loc="outside lower center", ncols=columns, frameon=False,
                  fontsize="small")  # fmt: skip
    with replacing(path) as temporary:
        figure.savefig(temporary, format=path.suffix[1:])


def _plain_numbers(axis: Any) -> None:
    """Ticks at 1, 1.5, 2, 3, 5, 7 of each decade, as people write them, as many as have room."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator  # noqa: PLC0415

    low, high = axis.get_view_interval()
    subs = (1, 2, 5) if high > 6 * low else (1, 1.5, 2, 3, 4, 5, 7)
    axis.set_major_locator(LogLocator(subs=subs, numticks=20))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: _short(value)))


def _short(value: float) -> str:
    for unit, sign in ((1e6, " M"), (1e3, " k")):
        if value >= unit:
            return f"{value / unit:g}{sign}"
    return f"{value:g}"


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
        ("seconds a frame (△ 2 × pixels, ▷ 2 × eyes)", "RMSE, levels of 255"),
    ),
}

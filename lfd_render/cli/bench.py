"""`lfd-render bench`: techniques against each other on this machine, as tables and plots."""

from __future__ import annotations

import dataclasses
import json as json_module
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lfd_render.cli import options
from lfd_render.cli.console import print_json, print_text, progress_bar, say, warn
from lfd_render.cli.outputs import check_folder_output, make_folder
from lfd_render.engine.texts import parse_size, parse_supersample
from lfd_render.errors import EXIT_INTERRUPTED, LfdError, UsageError

if TYPE_CHECKING:
    from lfd_render.bench.estimate import Progress
    from lfd_render.bench.measure import Effort
    from lfd_render.bench.results import Results
    from lfd_render.bench.row import Row
    from lfd_render.bench.suites import Axes, Group
    from lfd_render.display import DisplayProfile
    from lfd_render.gpu.device import Device

_QUICK_SUITES = ("aa",)
_SUITES = ("mvr", "aa", "supersample", "triangles", "views", "error")
_QUICK_TECHNIQUES = ("lfdpr", "lfdpr:paper", "mvr:multipass", "mvr:multipass-deferred")


def bench(
    output: Annotated[
        str,
        typer.Argument(
            metavar="FOLDER",
            help="For results.jsonl, results.json, tables.md and plots; unfinished ones are "
            "gone on with.",
        ),
    ],
    *,
    quick: Annotated[
        bool, typer.Option("--quick", help="Small scenes and few frames: some three minutes.")
    ] = False,
    suite: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="mvr, aa, supersample, triangles, views, error; when asked for: applications, "
            "ideas, sweep, rivals.",
        ),
    ] = None,
    scene: Annotated[
        list[str] | None, typer.Option(metavar="SCENE", help="Instead of the four bench scenes.")
    ] = None,
    technique: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="lfdpr, lfdpr:paper, exact, mvr:VARIANT, mvr:all or mvr:best.",
        ),
    ] = None,
    rivals: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,…",
            help="Also suite rivals: embree, mitsuba, vtk, each a package to be installed by name.",
        ),
    ] = None,
    aa: Annotated[list[options.Filter] | None, typer.Option(help="Filters of suite aa.")] = None,
    supersample: Annotated[
        list[str] | None, typer.Option(metavar="WHAT", help="Of suite supersample: 2, 2x1, 1x2, …")
    ] = None,
    views: Annotated[
        list[int] | None, typer.Option(metavar="N", min=1, help="Of suite views, besides 48.")
    ] = None,
    triangles: Annotated[
        list[int] | None,
        typer.Option(metavar="N", min=1, help="Of suite triangles, besides their own."),
    ] = None,
    scene_triangles: Annotated[
        int | None,
        typer.Option(metavar="N", min=0, help="Of built-in scenes elsewhere; 0: their own number."),
    ] = None,
    view_size: options.ViewSizeOption = None,
    rounds: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Counted frames of each, at most.")
    ] = None,
    row_seconds: Annotated[
        float | None,
        typer.Option(metavar="S", min=0.0, help="What they may take; there are three at least."),
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, max=16, help="Each way, a pixel of the standard's views."),
    ] = None,
    gold_size: Annotated[
        str | None,
        typer.Option(
            metavar="WxH|none",
            help="View size of the panel image's standard; the paper's is the panel's own.",
        ),
    ] = None,
    display: options.DisplayOption = options.DEFAULT_DISPLAY,
    against: Annotated[
        str | None,
        typer.Option(metavar="FOLDER", help="Measure nothing: compare with another run's ratios."),
    ] = None,
    device: options.DeviceOption = "auto",
    json: options.JsonOption = False,
) -> None:
    """Time techniques against the best multi-view rasterisation, each picture checked first."""
    options.check_device(device)
    if against is not None:
        _compare(Path(output), Path(against), json=json)
        return
    folder = check_folder_output(output)

    from lfd_render.bench.contenders import USUAL, techniques  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.bench.measure import Effort  # noqa: PLC0415
    from lfd_render.bench.rivals import check_names  # noqa: PLC0415
    from lfd_render.bench.suites import FILTERS, Axes, groups_of  # noqa: PLC0415
    from lfd_render.display import DisplayProfile  # noqa: PLC0415
    from lfd_render.renderer import upright_size  # noqa: PLC0415

    profile = DisplayProfile.load(display)
    default = Axes()
    axes = Axes(
        scenes=tuple(scene or default.scenes),
        techniques=techniques(technique or (_QUICK_TECHNIQUES if quick else USUAL)),
        aa=tuple(f.value for f in aa) if aa else (("none",) if quick else FILTERS),
        supersample=_samples(supersample) or default.supersample,
        views=tuple(views or default.views),
        triangles=tuple(triangles or ((50_000, 100_000) if quick else default.triangles)),
        extra="textures=256" if quick else "",
        usual_size=upright_size(profile, default.main_views),
        rivals=check_names(rivals.split(",")) if rivals else (),
        main_size=parse_size("--view-size", view_size) or ((240, 180) if quick else None),
        main_triangles=(50_000 if quick else 0) if scene_triangles is None else scene_triangles,
    )
    default_effort = Effort()
    effort = Effort(
        rounds=rounds or default_effort.rounds,
        least=5 if quick else default_effort.least,
        row_s=default_effort.row_s if row_seconds is None else row_seconds,
        compared=1 if quick else default_effort.compared,
        samples=samples or (4 if quick else default_effort.samples),
        gold_size=_gold_size(gold_size, None if quick else default_effort.gold_size),
    )
    suites = list(suite or (_QUICK_SUITES if quick else _SUITES))
    if axes.rivals and "rivals" not in suites:
        suites.append("rivals")
    groups = groups_of(suites, axes)
    make_folder(folder)
    results, interrupted = _measure(folder, groups, axes, effort, profile=profile, device=device)
    tables = _write(folder, results)
    if json:
        print_json({"folder": str(folder), **_summary(results)})
    else:
        print_text(tables)
    faulty = [row for row in results.rows if row.fault]
    for row in faulty:
        warn(f"{row.scene}: {row.contender} {row.fault}")
    missing = sum(not results.done(group.key) for group in groups)
    state = f", {missing} groups still to do; the same command goes on" if missing else ""
    if quick and not suite:
        say(f"--quick leaves out {', '.join(s for s in _SUITES if s not in _QUICK_SUITES)}")
    say(f"{folder}: {len(groups) - missing} groups of {len(groups)}{state}")
    if interrupted:
        raise typer.Exit(EXIT_INTERRUPTED)


def _measure(
    folder: Path,
    groups: Sequence[Group],
    axes: Axes,
    effort: Effort,
    *,
    profile: DisplayProfile,
    device: str,
) -> tuple[Results, bool]:
    """Measure what is missing; whether someone stopped it."""
    from lfd_render.bench.estimate import Progress, seconds, span  # noqa: PLC0415 (quick --help)
    from lfd_render.bench.machine import describe  # noqa: PLC0415
    from lfd_render.bench.measure import Bench  # noqa: PLC0415
    from lfd_render.bench.results import Results  # noqa: PLC0415
    from lfd_render.bench.row import unmeasured  # noqa: PLC0415
    from lfd_render.gpu.device import Device  # noqa: PLC0415

    opened = Device.open(device)
    try:
        machine = describe(opened)
        settings = {
            "machine": machine,
            "display": profile.hash,
            "effort": dataclasses.asdict(effort),
            "axes": dataclasses.asdict(axes),
        }
        results = Results(folder, settings)
        todo = [group for group in groups if not results.done(group.key)]
        left = Progress([seconds(group, effort, opened, cores=machine["cores"]) for group in todo])
        if todo:
            say(f"{len(todo)} groups to measure, some {span(left.left_s)} on a quiet machine")
        with _telling(left) as tell:
            bench = Bench(opened, profile, effort, tell, keep=folder)
            for group, guess in zip(todo, left.guesses, strict=True):
                begun = time.monotonic()
                chosen = group.with_best(_best(results, group, opened))
                try:
                    rows = bench.rows(chosen)
                except (LfdError, MemoryError) as error:
                    rows = unmeasured(chosen, error)
                results.add(rows)
                left.add(guess, time.monotonic() - begun)
    except KeyboardInterrupt:
        return results, True
    finally:
        opened.close()
    return results, False


def _best(results: Results, group: Group, device: Device) -> tuple[str, ...]:
    """The rasterisers that may be the best of a group's scene: by the filters' table, where it is
    measured, else by the ranking."""
    from lfd_render.bench.contenders import (  # noqa: PLC0415 (keeps --help quick)
        RANKED_CLOSE,
        TIMED_CLOSE,
        fastest,
    )
    from lfd_render.bench.suites import RANKING, family  # noqa: PLC0415

    for suite, close in (("aa", TIMED_CLOSE), (RANKING, RANKED_CLOSE)):
        times = {
            row.technique: row.median_ms
            for row in results.rows
            if suite in row.suites
            and row.valid
            and row.rasterises
            and family(row.scene) == family(group.scene)
        }
        if times:
            return fastest(device, times, group.eyes, close)
    return fastest(device, {}, group.eyes)


@contextmanager
def _telling(left: Progress) -> Iterator[Callable[[str], None]]:
    """Says what is being done and how long all will take: beside a bar on a terminal, else in a
    line now and then."""
    from lfd_render.bench.estimate import span  # noqa: PLC0415 (keeps --help quick)

    said = time.monotonic()
    with progress_bar("Measuring") as show:

        def tell(text: str) -> None:
            nonlocal said
            whole = f"{text}; {span(left.left_s)} left"
            show(left.part, whole)
            if time.monotonic() - said > 20.0 and not sys.stderr.isatty():
                said = time.monotonic()
                say(f"{100 * left.part:.0f} %: {whole}")

        yield tell


def _compare(folder: Path, other: Path, *, json: bool) -> None:
    """Ratios of two runs."""
    from lfd_render.bench.against import compare, table  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.bench.results import read_groups  # noqa: PLC0415

    entries = compare(read_groups(folder), read_groups(other))
    if json:
        print_json({"folder": str(folder), "against": str(other), "ratios": entries})
    else:
        print_text(table(entries))


def _write(folder: Path, results: Results) -> str:
    """Tables, plots and the JSON of all rows; the tables' text."""
    from lfd_render.bench.plots import write_plots  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.bench.tables import report  # noqa: PLC0415
    from lfd_render.display.files import replacing  # noqa: PLC0415

    tables = report(results.rows, results.settings)
    data = {"settings": results.settings, **_summary(results)}
    for name, text in (("tables.md", tables), ("results.json", json_module.dumps(data, indent=1))):
        with replacing(folder / name) as temporary:
            temporary.write_text(text, encoding="utf-8")
    try:
        write_plots(folder, results.rows)
    except UsageError as error:
        warn(str(error))
    return tables


def _summary(results: Results) -> dict[str, Any]:
    """Rows with their medians, and the ratio to the best rasteriser of each group."""
    from lfd_render.bench.row import best_mvr  # noqa: PLC0415 (keeps --help quick)

    found = []
    for rows in results.groups.values():
        best = best_mvr(rows)
        found += [_row(row, best) for row in rows]
    return {"rows": found}


def _row(row: Row, best: Row | None) -> dict[str, Any]:
    data = dataclasses.asdict(row)
    if row.valid:
        data |= {"median_ms": row.median_ms, "spread": round(row.spread, 4)}
    if row.valid and best:
        data |= {"best_mvr": best.technique, "ratio": round(row.times_faster(best), 4)}
        if cpu := row.times_faster_by_cpu(best):
            data["cpu_ratio"] = round(cpu, 4)
    return data


def _samples(texts: Sequence[str] | None) -> tuple[tuple[int, int], ...]:
    return tuple(parse_supersample(text) for text in texts or ())


def _gold_size(text: str | None, default: tuple[int, int] | None) -> tuple[int, int] | None:
    if text is None or text == "none":
        return None if text else default
    return parse_size("--gold-size", text)

"""Results as Markdown, laid out as the papers' own tables, with the papers' numbers beside them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from lfd_render.bench.contenders import PLAIN_MVR
from lfd_render.bench.papers import CATALOGUE, TABLE_1, TABLE_2, Printed
from lfd_render.bench.row import Row, best_mvr
from lfd_render.bench.suites import SCENES

_NOTABLE = 1.1
_PAPER_NAMES = {source: name for name, source in SCENES.items()}


def groups(rows: Sequence[Row], suite: str) -> list[list[Row]]:
    """Rows of one suite, group by group, in order."""
    found: dict[str, list[Row]] = {}
    for row in rows:
        if suite in row.suites:
            found.setdefault(row.group, []).append(row)
    return list(found.values())


def report(rows: Sequence[Row], settings: Mapping[str, Any]) -> str:
    """All tables that there are results for, gaps and faults named under each."""
    parts = [_head(settings)]
    for suite, (title, table) in _TABLES.items():
        if found := groups(rows, suite):
            parts.append(f"### {title}\n\n{table(found)}{_notes(found)}")
    return "\n\n".join(parts) + "\n"


def _head(settings: Mapping[str, Any]) -> str:
    machine, effort = settings["machine"], settings["effort"]
    changed = str(machine["commit"] or "")
    built = f"commit {changed}" if changed else f"version {machine['version']}"
    return (
        f"Measured by `lfd-render bench` on {machine['date']}, {built}: {machine['renderer']}, "
        f"{machine['driver']}, {machine['processor']}, {machine['cores']} cores. "
        f"Medians of {min(effort['least'], effort['rounds'])} to {effort['rounds']} frames of a "
        "turning scene, as many as a row's time allows; all rows of a group in turn; ± half the "
        "interquartile range. Times are wall clock between finishes. × is the least time of the "
        "best multi-view rasterisation of the group over the row's least: more than 1 is faster "
        "than it; by processor time it follows in brackets where that differs by a tenth. One of "
        "the frames timed is the picture that was checked."
    )


def scene_name(row: Row) -> str:
    """What tables call a scene."""
    source = row.scene.partition("?")[0]
    return f"{source.removeprefix('builtin:')} ({_count(row.triangles)})"


def paper_scene(row: Row) -> str:
    """The paper's scene of this kind; empty for others."""
    return _PAPER_NAMES.get(row.scene.partition("?")[0], "")


def _count(number: int) -> str:
    if number >= 999_500:
        return f"{number / 1e6:.2f}M"
    return f"{number / 1e3:.1f}K" if number >= 1000 else str(number)


def ratio(row: Row, best: Row | None) -> str:
    """The best rasteriser's time over a row's, and by processor time where that says otherwise."""
    if not best or not row.valid:
        return ""
    wall, cpu = row.times_faster(best), row.times_faster_by_cpu(best)
    text = f"{wall:.2f} ×"
    if cpu and max(cpu, wall) > _NOTABLE * min(cpu, wall):
        text += f" [{cpu:.2f} ×]"
    return text


def _ms(value: float) -> str:
    return f"{value:.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2f}"


def _quality(row: Row) -> str:
    """Two cells: RMSE and SSIM, each of the panel image and of a view."""
    rmse = _errors(row.eia_rmse, row.view_rmse, 2)
    return f"{rmse} | {_errors(row.eia_ssim, row.view_ssim, 4)}"


def _errors(whole: float | None, view: float | None, digits: int) -> str:
    texts = [f"{v:.{digits}f}" for v in (whole, view) if v is not None]
    return f"{texts[0]} ({texts[1]})" if len(texts) == 2 else f"({texts[0]})" if texts else ""


def _printed(printed: Printed | None, mvr: Printed | None) -> str:
    """Total, speed-up, and that with one pass for the panel image for both."""
    if printed is None or mvr is None:
        return ""
    if printed is mvr:
        return f"{printed.total_ms:.2f}"
    shared = mvr.shared_eia(printed.eia_ms) / printed.total_ms
    return f"{printed.total_ms:.2f} ({mvr.total_ms / printed.total_ms:.2f} ×; {shared:.2f} ×)"


def _notation(row: Row) -> str:
    """004's name of a pipeline, whose bar would end a cell."""
    return row.notation.replace("|", r"\|")


def _full(found: list[list[Row]], paper: Callable[[Row, Row | None], str], first: str = "") -> str:
    """Tables 1 and 2: one row a contender."""
    columns = (
        f"Scene{first} | Method | points, ms (number) | views, ms | panel image, ms | frame, ms | "
        "frames | × | memory, MB | RMSE of panel image (view) | SSIM (view) | "
        "paper: ms (×; × with one panel pass)"
    )
    lines = [f"| {columns} |", "|---" * (columns.count("|") + 1) + "|"]
    for rows in found:
        best = best_mvr(rows)
        for row in rows:
            if not row.valid:
                continue
            scene = scene_name(row)
            if first:
                scene += f" | {_supersample(row)}"
            points = f"{_ms(row.stage_ms('points'))} ({_count(row.points)})" if row.points else ""
            mark = "**" if row is best else ""
            cells = [
                scene,
                f"{mark}{row.contender}{mark}" + (f" {_notation(row)}" if row.notation else ""),
                points,
                _ms(row.stage_ms("views")),
                _ms(row.stage_ms("eia")),
                f"{_ms(row.median_ms)} ± {100 * row.spread:.0f} %",
                str(len(row.frames_ms)),
                ratio(row, best),
                f"{row.device_bytes / 1e6:.0f}",
                _errors(row.eia_rmse, row.view_rmse, 2),
                _errors(row.eia_ssim, row.view_ssim, 3),
                paper(row, best),
            ]
            lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _supersample(row: Row) -> str:
    return "space" if row.supersample[0] > 1 else "angle" if row.supersample[1] > 1 else "none"


def _of_table_1(row: Row, best: Row | None) -> str:
    scene = paper_scene(row)
    kind = "mvr" if row.technique == PLAIN_MVR else row.aa
    if row.technique not in (PLAIN_MVR, "lfdpr:paper"):
        return ""
    return _printed(TABLE_1.get((scene, kind)), TABLE_1.get((scene, "mvr")))


def _of_table_2(row: Row, best: Row | None) -> str:
    """The paper's rasterisation, which is plain, stands beside the best where only that is here."""
    key = (paper_scene(row), row.supersample)
    if row is not best and row.technique not in (PLAIN_MVR, "lfdpr:paper"):
        return ""
    kind = "mvr" if row.rasterises else "lfdpr"
    return _printed(TABLE_2.get((*key, kind)), TABLE_2.get((*key, "mvr")))


def _swept(found: list[list[Row]], label: str, of: Callable[[Row], str]) -> str:
    """One row a group, one column a contender: milliseconds, and × of the best rasteriser."""
    names = list(dict.fromkeys(row.contender for rows in found for row in rows))
    lines = [f"| Scene | {label} | " + " | ".join(names) + " |", "|---" * (len(names) + 2) + "|"]
    for rows in found:
        best = best_mvr(rows)
        by_name = {row.contender: row for row in rows}
        cells = []
        for name in names:
            row = by_name.get(name)
            if row is None or not row.valid:
                cells.append("–")
            elif row is best:
                cells.append(f"**{_ms(row.median_ms)}**")
            else:
                cells.append(f"{_ms(row.median_ms)} ({ratio(row, best)})".replace(" ()", ""))
        scene = next((r for r in rows if r.triangles), rows[0])
        lines.append(f"| {scene_name(scene)} | {of(rows[0])} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _by_size(found: list[list[Row]]) -> str:
    """Speed and error by view size."""
    lines = [
        "| Scene | views of | SS | Method | frame, ms | × | RMSE of panel image (view) | "
        "SSIM (view) |",
        "|---" * 8 + "|",
    ]
    for rows in found:
        best = best_mvr(rows)
        lines += [
            f"| {scene_name(row)} | {row.view_size[0]} × {row.view_size[1]} | "
            f"{_supersample(row)} | {row.contender} | "
            f"{_ms(row.median_ms)} | {ratio(row, best)} | "
            f"{_quality(row)} |"
            for row in rows
            if row.valid
        ]
    return "\n".join(lines)


def _beside_lfdpr(found: list[list[Row]]) -> Iterator[tuple[Row, str]]:
    """Rows that count, each with its frame and how many of LFDPR's that is, two cells."""
    for rows in found:
        ours = next((r for r in rows if r.contender == "lfdpr" and r.valid), None)
        for row in rows:
            if row.valid:
                share = f"{ours.times_faster(row):.2f} ×" if ours else ""
                yield row, f"{_ms(row.median_ms)} ± {100 * row.spread:.0f} % | {share}"


def _ideas(found: list[list[Row]]) -> str:
    """What each idea of LFDPR gives."""
    lines = [
        "| Scene | Method | points | frame, ms | of lfdpr's | RMSE of panel image (view) | "
        "SSIM (view) |",
        "|---" * 7 + "|",
    ]
    lines += [
        f"| {scene_name(row)} | {row.contender} | {f'{row.points:,}' if row.points else ''} | "
        f"{frame} | {_quality(row)} |"
        for row, frame in _beside_lfdpr(found)
    ]
    return "\n".join(lines)


def _sweep(found: list[list[Row]]) -> str:
    """What filters, supersamples and continuous angles buy."""
    lines = [
        "| Scene | SS | Method | RMSE of panel image (view) | SSIM (view) | sweep FLIP | "
        "sweep change | frame, ms |",
        "|---" * 8 + "|",
    ]
    lines += [
        f"| {scene_name(row)} | {_supersample(row)} | {row.contender} | "
        f"{_quality(row)} | "
        f"{row.sweep_flip or 0.0:.4f} | {row.sweep_change or 0.0:.2f} | {_ms(row.median_ms)} |"
        for rows in found
        for row in rows
        if row.valid
    ]
    return "\n".join(lines)


def _outside(found: list[list[Row]]) -> str:
    """Programs from outside, against LFDPR's whole frame."""
    lines = ["| Scene | Method | frame, ms | of lfdpr's | leaves out |", "|---" * 5 + "|"]
    lines += [
        f"| {scene_name(row)} | {row.contender} | {frame} | {row.leaves_out} |"
        for row, frame in _beside_lfdpr(found)
    ]
    return "\n".join(lines)


def _catalogue(found: list[list[Row]]) -> str:
    """All rasterisers, ranked in each group."""
    lines = ["| Scene | views | Pipeline | | frame, ms | of plain | memory, MB |", "|---" * 7 + "|"]
    for rows in found:
        plain = next((r for r in rows if r.technique == "mvr:multipass" and r.valid), None)
        for row in sorted((r for r in rows if r.valid), key=lambda r: r.median_ms):
            share = f"{plain.times_faster(row):.2f}" if plain else ""
            lines.append(
                f"| {scene_name(row)} | {row.views} | {row.technique.removeprefix('mvr:')} | "
                f"{_notation(row)} | {_ms(row.median_ms)} ± {100 * row.spread:.0f} % | {share} | "
                f"{row.device_bytes / 1e6:.0f} |"
            )
    return "\n".join(lines)


def _applications(found: list[list[Row]]) -> str:
    """Tables 2 to 4 of the catalogue, an application after another, and what it printed."""
    parts = []
    for application, (where, printed) in CATALOGUE.items():
        groups = [rows for rows in found if rows[0].application == application]
        if not groups:
            continue
        columns = {
            "M.Pass": PLAIN_MVR,
            "GSL4": "mvr:loop-4-frustum" if application == "ids" else "mvr:loop-4",
            "GSI4": "mvr:invocations-4",
            "OVR4": "mvr:multiview-4",
        }
        count = "lights" if application == "shadow maps" else "views"
        lines = [
            f"| {application} of | {count} | {' | '.join(columns)} | LFDPR | pixels that differ |",
            "|---" * (len(columns) + 4) + "|",
        ]
        for rows in groups:
            of = {row.technique: row for row in rows if row.valid}
            least = min((row.median_ms for row in of.values()), default=0.0)
            cells = []
            for technique in (*columns.values(), "lfdpr"):
                row = of.get(technique)
                mark = "**" if row and row.median_ms == least else ""
                cells.append(f"{mark}{_ms(row.median_ms)}{mark}" if row else "–")
            most = max(
                (row.differs for row in of.values() if row.differs is not None), default=None
            )
            width, height = next((r.view_size for r in rows if r.valid), (0, 0))
            apart = "" if most is None else f"{100 * most:.3f} %"
            scene = next((r for r in rows if r.triangles), rows[0])
            lines.append(
                f"| {scene_name(scene)}, {width} × {height} | {rows[0].views} | "
                f"{' | '.join(cells)} | {apart} |"
            )
        for number, rows_of in enumerate(printed, 1):
            for views, times in rows_of.items():
                lines.append(
                    f"| printed: {where}, scene {number}, RTX 2080 | {views} | "
                    f"{' | '.join(map(str, times))} | | |"
                )
        parts.append("\n".join(lines))
    return "\n\n".join(parts)


def _notes(found: list[list[Row]]) -> str:
    """What is missing, and what was caught: by reason and scenes, all whom it is about."""
    gaps: dict[str, dict[str, list[str]]] = {}
    for rows in found:
        for row in rows:
            why = row.gap or (f"wrong picture, its time left out: {row.fault}" if row.fault else "")
            if why:
                gaps.setdefault(why, {}).setdefault(row.contender, []).append(row.scene)
    lines = []
    for why, places in gaps.items():
        by_scenes: dict[str, list[str]] = {}
        for contender, scenes in places.items():
            everywhere = len(found) > 1 and len(scenes) == len(found)
            where = "" if everywhere else f" ({', '.join(dict.fromkeys(scenes))})"
            by_scenes.setdefault(where, []).append(contender)
        lines += [f"- Missing: {', '.join(who)}: {why}{w}." for w, who in by_scenes.items()]
    return "\n\n" + "\n".join(lines) if lines else ""


_TABLES: dict[str, tuple[str, Callable[[list[list[Row]]], str]]] = {
    "aa": ("Filters (Table 1 of Gavane and Watson 2024)", lambda g: _full(g, _of_table_1)),
    "supersample": (
        "Supersampling (Table 2 of Gavane and Watson 2024)",
        lambda g: _full(g, _of_table_2, " | SS"),
    ),
    "triangles": ("Time against triangles", lambda g: _swept(g, "views", lambda r: str(r.views))),
    "views": ("Time against views", lambda g: _swept(g, "views", lambda r: str(r.views))),
    "error": ("Speed against error (as Fig. 6 of EPR)", _by_size),
    "mvr": ("The ranking of the catalogue of multi-view rasterisation", _catalogue),
    "applications": (
        "Applications (Tables 2 to 4 of the catalogue), milliseconds",
        _applications,
    ),
    "ideas": ("Each idea of LFDPR, on and off", _ideas),
    "sweep": ("What an eye sees that moves, an eighth of a view interval a frame", _sweep),
    "rivals": ("Programs from outside, same scene, eyes, view size and machine", _outside),
}

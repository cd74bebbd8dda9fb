"""Two runs beside each other: whether ratios that one found are found again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from lfd_render.bench.row import Row, best_mvr

MOST_DIFFERENT = 0.10  # of ratios of two runs on a quiet machine


def compare(
    groups: Mapping[str, Sequence[Row]], others: Mapping[str, Sequence[Row]]
) -> list[dict[str, Any]]:
    """Rows that both runs have, with the time of the same rasteriser over theirs in each: the best
    of the first run, so that a change of the best is no change of all ratios. differ: how much
    larger the greater ratio is; the same for processor time, where both know it."""
    found = []
    for key, rows in groups.items():
        best = best_mvr(list(rows))
        there = {row.contender: row for row in others.get(key, []) if row.valid}
        if best is None or best.contender not in there:
            continue
        base = there[best.contender]
        for row in rows:
            other = there.get(row.contender)
            if not row.valid or other is None or row is best:
                continue
            ratios = row.times_faster(best), other.times_faster(base)
            entry = {
                "group": key, "contender": row.contender, "best_mvr": best.contender,
                "ratio": round(ratios[0], 4), "other_ratio": round(ratios[1], 4),
                "differ": round(max(ratios) / min(ratios) - 1, 4),
                "frames": [len(row.frames_ms), len(other.frames_ms)],
                "same_best": best_mvr(list(others[key])) is base,
            }  # fmt: skip
            cpu = row.times_faster_by_cpu(best), other.times_faster_by_cpu(base)
            if cpu[0] and cpu[1]:
                entry |= {
                    "cpu_ratio": round(cpu[0], 4), "other_cpu_ratio": round(cpu[1], 4),
                    "cpu_differ": round(max(cpu[0] / cpu[1], cpu[1] / cpu[0]) - 1, 4),
                }  # fmt: skip
            found.append(entry)
    return found


def table(entries: Sequence[Mapping[str, Any]]) -> str:
    """As Markdown, the greatest difference first, and a line that says how many are too large."""
    lines = [
        "| Group | Method | × here | × there | differ | by processor time | |",
        "|---" * 7 + "|",
    ]
    for entry in sorted(entries, key=lambda e: -e["differ"]):
        cpu = ""
        if "cpu_differ" in entry:
            cpu = (
                f"{entry['cpu_ratio']:.2f}, {entry['other_cpu_ratio']:.2f}: "
                f"{100 * entry['cpu_differ']:.1f} %"
            )
        said = ["**over 10 %**"] if entry["differ"] > MOST_DIFFERENT else []
        said += [] if entry["same_best"] else ["another rasteriser was the best there"]
        lines.append(
            f"| {entry['group']} | {entry['contender']} | {entry['ratio']:.2f} | "
            f"{entry['other_ratio']:.2f} | {100 * entry['differ']:.1f} % | {cpu} | "
            f"{', '.join(said)} |"
        )
    if not entries:
        return "No rows that both runs have."
    over = sum(entry["differ"] > MOST_DIFFERENT for entry in entries)
    most = max(entry["differ"] for entry in entries)
    return "\n".join(
        [*lines, "", f"{len(entries)} ratios in both runs; the greatest difference is "
         f"{100 * most:.1f} %, {over} exceed 10 %."]
    )  # fmt: skip

"""Golden view-index maps, by scalar loops over the published formulas alone.

Nothing of the project is imported: Python's own float64 and fractions decide. Run it in this folder
to write the files again, or with --check to see that they are as it would write them.
"""

import copy
import json
import math
import sys
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parent
Map = list[list[list[int]]]  # [y][x][channel], y from the top
Phase = Callable[[int, int, int], float]  # of x, y from the bottom, channel

WIDTH, HEIGHT, VIEWS = 22, 13, 48
LENS = {"lens_count": 2.7461, "drift": -0.0973, "center": 0.2137, "index": 1.49}


def profile(**changes: Any) -> dict[str, Any]:
    """A profile file of a small panel."""
    data: dict[str, Any] = {
        "schema": "lfd-display/1",
        "name": "conformance",
        "panel": {
            "resolution_px": [WIDTH, HEIGHT],
            "size_mm": [2.2, 1.3],
            "subpixels": {"layout": "stripe", "order": "rgb", "origin": "red-at-pixel-centre"},
        },
        "lens": dict(LENS),
        "viewing": {"views": VIEWS, "cone_deg": 40.0, "distance_mm": 600.0, "spacing": "lens"},
    }
    for path, value in changes.items():
        *sections, field = path.split("__")
        part = data
        for section in sections:
            part = part[section]
        part[field] = value
    return data


# -- the formulas ----------------------------------------------------------------------------


def view_of(phase: float, views: int, inverted: bool = False) -> int:
    """⌊z·N⌋, z = 1 − frac φ, at most N − 1. Refuses phases that rounding could decide."""
    within = phase - math.floor(phase)
    slot = within * views
    assert abs(slot - round(slot)) > 1e-7, "choose other numbers: a phase lies on a boundary"
    z = within if inverted else 1.0 - within
    return min(math.floor(z * views), views - 1)


def map_of(
    phase: Phase, views: int, inverted: bool = False, size: tuple[int, int] = (WIDTH, HEIGHT)
) -> Map:
    """View of every subpixel of a panel."""
    width, height = size
    return [
        [
            [view_of(phase(x, height - 1 - y, c), views, inverted) for c in range(3)]
            for x in range(width)
        ]
        for y in range(height)
    ]


def stripes(
    lens: dict[str, float], places: tuple[float, float, float], up: bool = False, *,
    size: tuple[int, int] = (WIDTH, HEIGHT), half: float = 0.5, less: int = 0,
) -> Phase:  # fmt: skip
    """φ = (u + right/W + (v + above/H)·T)·P − center, stripes `places[c]` pixels right or above."""
    width, height = size
    count, drift, center = lens["lens_count"], lens["drift"], lens["center"]

    def phase(x: int, y: int, c: int) -> float:
        right, above = (0.0, places[c]) if up else (places[c], 0.0)
        u = (x + half) / (width - less) + right / width
        v = (y + half) / (height - less) + above / height
        return (u + v * drift) * count - center

    return phase


RGB, BGR = (0.0, 1 / 3, 2 / 3), (2 / 3, 1 / 3, 0.0)


def cell_kind(mode: int, x: int, y: int) -> int:
    """Cell of a pixel, y from the bottom."""
    if mode == 1:
        return 0 if x % 2 == y % 2 else 1
    if mode == 2:
        return x % 2
    if mode == 3:
        return (y + 2 * (x % 2)) % 4
    if mode == 4:
        return y % 2
    return 0


def cells(lens: dict[str, float], mode: int, offsets: list[list[list[float]]]) -> Phase:
    """φ = (u + Xoff/W + (v + Yoff/H)·T)·P − center."""

    def phase(x: int, y: int, c: int) -> float:
        right, above = offsets[cell_kind(mode, x, y)][c]
        u = (x + 0.5 + right) / WIDTH
        v = (y + 0.5 + above) / HEIGHT
        return (u + v * lens["drift"]) * lens["lens_count"] - lens["center"]

    return phase


CELLS = [
    [[-0.31, 0.12], [0.02, -0.21], [0.33, 0.11]],
    [[-0.29, -0.18], [0.01, 0.24], [0.35, -0.07]],
    [[0.30, 0.05], [-0.03, 0.15], [-0.34, -0.22]],
    [[0.27, -0.13], [0.04, -0.02], [-0.36, 0.19]],
]
KINDS = (1, 2, 2, 4, 2)


def corrected(phase: Phase, grid: list[list[float]]) -> Phase:
    """The phase and a grid of corrections, from corner to corner, bilinear, top row first."""

    def phase_of(x: int, y: int, c: int) -> float:
        across = (x + 0.5) / WIDTH * (len(grid[0]) - 1)
        down = (HEIGHT - 1 - y + 0.5) / HEIGHT * (len(grid) - 1)
        left, top = min(int(across), len(grid[0]) - 2), min(int(down), len(grid) - 2)
        a, b = across - left, down - top
        upper = (1 - a) * grid[top][left] + a * grid[top][left + 1]
        lower = (1 - a) * grid[top + 1][left] + a * grid[top + 1][left + 1]
        return phase(x, y, c) + (1 - b) * upper + b * lower

    return phase_of


def mounted(seen: Map, rotation_deg: int, flip_x: bool, flip_y: bool) -> Map:
    """As the panel takes it: flipped, then turned counter-clockwise."""
    rows = [list(reversed(row)) if flip_x else list(row) for row in seen]
    if flip_y:
        rows.reverse()
    for _ in range(rotation_deg // 90):
        rows = [[row[x] for row in rows] for x in range(len(rows[0]) - 1, -1, -1)]
    return rows


VISUAL = {
    "pitch": 31.347, "slope": -6.0217, "center": 0.2137, "fringe": 0.0, "viewCone": 40.0,
    "invView": 1.0, "verticalAngle": 0.0, "DPI": 253.0, "screenW": WIDTH, "screenH": HEIGHT,
    "flipImageX": 0.0, "flipImageY": 0.0, "flipSubp": 0.0,
}  # fmt: skip


def visual_json(**changes: float) -> dict[str, Any]:
    """The vendor's file, each number wrapped as the vendor does."""
    numbers = VISUAL | changes
    wrapped = {name: {"value": value} for name, value in numbers.items()}
    return {"configVersion": "3.0", "serial": "conformance", **wrapped}


def visual_lens(**changes: float) -> dict[str, float]:
    """P = pitch·(screenW/DPI)·cos(atan(1/slope)), T = screenH/(screenW·slope), −T if flipImageX."""
    n = VISUAL | changes
    count = n["pitch"] * (n["screenW"] / n["DPI"]) * math.cos(math.atan(1 / n["slope"]))
    drift = n["screenH"] / (n["screenW"] * n["slope"]) * (-1 if n["flipImageX"] else 1)
    return {"lens_count": count, "drift": drift, "center": n["center"]}


def form(name: str, numbers: dict[str, float], **lens: float) -> dict[str, Any]:
    """A file of another system's numbers."""
    rest = profile()
    rest["lens"] = lens
    return {"schema": "lfd-display-form/1", "form": name, "numbers": numbers, "profile": rest}


def van_berkel(subpixels: float, lean: float, offset: float) -> Map:
    """V = ⌊((k + ½ + k_off − 3·l·tan α) mod X)·N/X⌋ from the right, l from the top."""

    def view(x: int, row: int, c: int) -> int:
        k = 3 * x + c
        slot = ((k + 0.5 + offset - 3 * row * lean) % subpixels) * VIEWS / subpixels
        assert abs(slot - round(slot)) > 1e-7
        return VIEWS - 1 - math.floor(slot)

    return [[[view(x, y, c) for c in range(3)] for x in range(WIDTH)] for y in range(HEIGHT)]


def leia(across: float, down: float, colour: float, offset: float) -> Map:
    """z = m·(x, y, c/3) + b, view = ⌊z·N + ½⌋ mod N, y from the top."""

    def view(x: int, row: int, c: int) -> int:
        at = (across * x + down * row + colour * c / 3 + offset) * VIEWS + 0.5
        assert abs(at - round(at)) > 1e-7
        return math.floor(at) % VIEWS

    return [[[view(x, y, c) for c in range(3)] for x in range(WIDTH)] for y in range(HEIGHT)]


def physical(
    pitch: float, tilt_deg: float, gap: float, index: float, center: float
) -> dict[str, float]:
    """p_h = p⊥/cos α, seen as p_h·(1 + t/(n·D)); T = (h/w)·tan α."""
    period = pitch / math.cos(math.radians(tilt_deg)) * (1 + gap / (index * 600.0))
    drift = 1.3 / 2.2 * math.tan(math.radians(tilt_deg))
    return {"lens_count": 2.2 / period, "drift": drift, "center": center}


def global_3d(numbers: tuple[int, int, int, int, bool, int]) -> Map:
    """(⌊3·x + dir·((y·num/den) mod n) + n⌋ + offset + c) mod n from the right, y from the top."""
    views, numerator, denominator, direction, bgr, offset = numbers

    def view(x: int, row: int, c: int) -> int:
        shift = direction * (Fraction(row * numerator, denominator) % views)
        stripe = 2 - c if bgr else c
        return views - 1 - (math.floor(3 * x + shift + views) + offset + stripe) % views

    return [[[view(x, y, c) for c in range(3)] for x in range(WIDTH)] for y in range(HEIGHT)]


def ini(numbers: tuple[int, int, int, int, bool, int]) -> str:
    """The monitor's file, with our section on the panel."""
    views, numerator, denominator, direction, bgr, offset = numbers
    return (
        f"[interlacing]\nviews = {views}\nangle_numerator = {numerator}\n"
        f"angle_denominator = {denominator}\ndirection = {direction}\nbgr = {int(bgr)}\n"
        f"offset = {offset}\n\n[panel]\nwidth_px = {WIDTH}\nheight_px = {HEIGHT}\nwidth_mm = 2.2\n"
        "height_mm = 1.3\ndistance_mm = 600\ncone_deg = 40\n"
    )


# -- the cases -------------------------------------------------------------------------------


def cases() -> Iterator[tuple[str, str, Any, int, Map]]:
    """Name, formula in words, input, views and map of each."""
    plain = "(u + c/(3W) + v·T)·P − center"
    for name, drift in (("right", -0.0973), ("left", 0.0973), ("upright", 0.0)):
        lens = LENS | {"drift": drift}
        yield (
            f"stripe-lean-{name}",
            plain,
            profile(lens=lens),
            VIEWS,
            map_of(stripes(lens, RGB), VIEWS),
        )
    for views in (1, 7, 255):
        yield (
            f"stripe-{views}-views",
            plain,
            profile(viewing__views=views),
            views,
            map_of(stripes(LENS, RGB), views),
        )
    for order in ("rgb", "bgr"):
        for origin in ("red", "green", "blue"):
            start = order.index(origin[0])
            places = tuple((order.index(c) - start) / 3 for c in "rgb")
            for axis in ("right", "up"):
                told = {
                    "layout": "stripe",
                    "order": order,
                    "origin": f"{origin}-at-pixel-centre",
                    "axis": axis,
                }
                found = map_of(
                    stripes(LENS, (places[0], places[1], places[2]), axis == "up"), VIEWS
                )
                words = f"{plain}, stripes read {axis}"
                yield (
                    f"stripe-{order}-{origin}-{axis}",
                    words,
                    profile(panel__subpixels=told),
                    VIEWS,
                    found,
                )
    for mode, kinds in enumerate(KINDS):
        told = {"layout": "cells", "pattern_mode": mode, "offsets_px": CELLS[:kinds]}
        words = "(u + Xoff/W + (v + Yoff/H)·T)·P − center"
        yield (
            f"cells-mode-{mode}",
            words,
            profile(panel__subpixels=told),
            VIEWS,
            map_of(cells(LENS, mode, CELLS), VIEWS),
        )
    yield (
        "inverted",
        "z = frac φ",
        profile(viewing__inverted=True),
        VIEWS,
        map_of(stripes(LENS, RGB), VIEWS, True),
    )
    grid = [[0.0, 0.11, -0.07], [0.05, -0.12, 0.2]]
    told = profile(correction={"phase_lenses": grid})
    yield (
        "correction",
        f"{plain} + correction",
        told,
        VIEWS,
        map_of(corrected(stripes(LENS, RGB), grid), VIEWS),
    )
    seen = map_of(stripes(LENS, RGB), VIEWS)
    for turn in (0, 90, 180, 270):
        for x, y in ((False, False), (True, False), (False, True)):
            mount = {"rotation_deg": turn, "flip_x": x, "flip_y": y}
            name = f"mount-{turn}" + ("-flip-x" if x else "") + ("-flip-y" if y else "")
            yield (
                name,
                f"{plain}, the picture as the panel takes it",
                profile(panel__mount=mount),
                VIEWS,
                mounted(seen, turn, x, y),
            )
    changes: dict[str, float]
    for name, changes in (
        ("plain", {}), ("slope-positive", {"slope": 6.0217}), ("flip-x", {"flipImageX": 1.0}),
        ("inverted", {"invView": 0.0}), ("flip-subp", {"flipSubp": 1.0}),
    ):  # fmt: skip
        phase = stripes(visual_lens(**changes), BGR if "flipSubp" in changes else RGB)
        found = map_of(phase, VIEWS, "invView" in changes)
        yield (
            f"visual-json-{name}",
            "Looking Glass visual.json",
            visual_json(**changes),
            VIEWS,
            found,
        )
    vendor = visual_json(CellPatternMode=1.0)
    vendor["subpixelCells"] = [
        {
            f"{c}Offset{axis}": xy[i]
            for c, xy in zip("RGB", kind, strict=True)
            for i, axis in enumerate("XY")
        }
        for kind in CELLS[:2]
    ]
    yield (
        "visual-json-cells",
        "Looking Glass visual.json",
        vendor,
        VIEWS,
        map_of(cells(visual_lens(), 1, CELLS), VIEWS),
    )
    numbers = {"subpixels_per_lens": 24.0339, "tan_alpha": -0.16470, "k_off": 3.173}
    yield (
        "van-berkel",
        "van Berkel",
        form("van-berkel", numbers),
        VIEWS,
        van_berkel(*numbers.values()),
    )
    numbers = {
        "pitch_mm": 0.7931,
        "tilt_deg": 9.37,
        "gap_mm": 1.21,
        "index": 1.49,
        "center": -0.371,
    }
    found = map_of(stripes(physical(*numbers.values()), RGB), VIEWS)
    yield "physical", "pitch, tilt, gap and index", form("physical", numbers), VIEWS, found
    numbers = {"m_x": -0.12483, "m_y": 0.02117, "m_c": -0.12483, "b": 0.5319}
    yield "leia", "Leia's matrix", form("leia", numbers), VIEWS, leia(*numbers.values())
    for views, numerator, denominator, direction, bgr, offset in (
        (7, 4, 5, 1, False, 0), (7, 4, 5, -1, False, 3), (17, 4, 5, 1, True, 2),
        (7, 0, 1, 1, False, 1),
    ):  # fmt: skip
        name = (
            f"3d-global-{views}-{numerator}_{denominator}-{'right' if direction < 0 else 'left'}"
            + ("-bgr" if bgr else "")
        )
        numbers_3d = (views, numerator, denominator, direction, bgr, offset)
        yield name, "3D Global INI", ini(numbers_3d), views, global_3d(numbers_3d)


def controls() -> Iterator[tuple[str, str, Any, int, Map]]:
    """Maps of two known mistakes, which a right implementation must not give."""
    size, lens = (96, 24), {"lens_count": 15.4357, "drift": -0.0457, "center": 0.40277}
    told = profile(panel__resolution_px=list(size), panel__size_mm=[9.6, 2.4], lens=lens)
    half = map_of(stripes(lens, RGB, size=size, half=0.0), VIEWS, size=size)
    yield "without-half-pixel", "WRONG: u = x/W, v = y/H", told, VIEWS, half
    less = map_of(stripes(lens, RGB, size=size, less=1), VIEWS, size=size)
    yield (
        "over-width-less-one",
        "WRONG: u = (x + ½)/(W − 1), v = (y + ½)/(H − 1)",
        told,
        VIEWS,
        less,
    )


def text_of(name: str, formula: str, told: Any, views: int, found: Map) -> str:
    """The file of a case, a panel row a line."""
    head = json.dumps(
        {"name": name, "formula": formula, "views": views, "input": copy.deepcopy(told)},
        ensure_ascii=False,
    )
    rows = ",\n".join(
        json.dumps([v for pixel in row for v in pixel], separators=(",", ":")) for row in found
    )
    return f'{head[:-1]}, "map": [\n{rows}\n]}}\n'


def main() -> int:
    """Write the files, or compare with them."""
    wanted = {FOLDER / "cases" / f"{case[0]}.json": text_of(*case) for case in cases()}
    wanted |= {FOLDER / "controls" / f"{case[0]}.json": text_of(*case) for case in controls()}
    there = {*FOLDER.glob("cases/*.json"), *FOLDER.glob("controls/*.json")}
    if "--check" in sys.argv[1:]:
        wrong = [
            p
            for p in wanted.keys() | there
            if p not in there or wanted.get(p) != p.read_text("utf-8")
        ]
        print(*(f"differs: {path}" for path in sorted(wrong)), f"{len(wanted)} files", sep="\n")
        return int(bool(wrong))
    for path in there - wanted.keys():
        path.unlink()
    for path, text in wanted.items():
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())

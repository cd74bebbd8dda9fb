"""Random valid profiles from a seed, and what can be done to them that must be refused."""

import copy
import math
from collections.abc import Callable
from typing import Any

import numpy as np

KINDS = (1, 2, 2, 4, 2)
PERCENT = 0.3  # of profiles that have each optional part


def profile_data(rng: np.random.Generator) -> dict[str, Any]:
    """Plain data of a valid profile, all parts of the format taken in turn."""
    width, height = (int(px) for px in rng.integers(8, 9000, 2))
    pixel_mm = 10 ** rng.uniform(-2.0, 0.5)
    lens: dict[str, Any] = {
        "lens_count": float(rng.uniform(1, width)),
        "drift": float(rng.choice([rng.uniform(-1, 1), rng.uniform(-10, 10), 0.0])),
        "center": float(rng.choice([rng.uniform(-1, 1), rng.normal(0, 1e3), 0.0])),
        "index": float(rng.uniform(1, 4)),
    }
    views = int(rng.integers(1, 200))
    data: dict[str, Any] = {
        "schema": "lfd-display/1",
        "name": "".join(map(chr, rng.integers(32, 0x2FF, int(rng.integers(1, 12))))),
        "panel": {
            "resolution_px": [width, height],
            "size_mm": [width * pixel_mm, height * pixel_mm * float(rng.choice([1, 1.25]))],
            "subpixels": _subpixels(rng),
        },
        "lens": lens,
        "viewing": {
            "views": views,
            "cone_deg": float(rng.uniform(0.1, 179)),
            "distance_mm": float(10 ** rng.uniform(1, 5)),
            "spacing": str(rng.choice(["lens", "angle", "tangent"])),
            "inverted": bool(rng.random() < PERCENT),
        },
    }
    if rng.random() < PERCENT:
        data["serial"], data["date"] = (
            "LKG-7",
            f"20{rng.integers(10, 99)}-02-{rng.integers(10, 29)}",
        )
    if rng.random() < PERCENT:
        data["panel"]["mount"] = {
            "rotation_deg": int(rng.choice([0, 90, 180, 270])),
            "flip_x": bool(rng.random() < 0.5),
            "flip_y": bool(rng.random() < 0.5),
        }
    if rng.random() < PERCENT:
        lens["gap_mm"] = float(10 ** rng.uniform(-2, 1))
    if rng.random() < PERCENT:
        data["response"] = {"kind": "gaussian", "sigma_views": rng.uniform(0, 3, 3).tolist()}
    if rng.random() < PERCENT:
        shape = tuple(rng.integers(2, 6, 2))
        data["correction"] = {"phase_lenses": rng.normal(0, 0.2, shape).tolist()}
    if rng.random() < PERCENT:
        data["uncertainty"] = {"lens_count": float(rng.random()), "center": 0.01}
        data["provenance"] = {
            "source": "seeded",
            "template": bool(rng.random() < 0.5),
            "assumed": ["lens.index"],
            "fields": [{"field": "lens.center", "source": "by eye"}],
        }
    return data


def _subpixels(rng: np.random.Generator) -> dict[str, Any]:
    if rng.random() < PERCENT:
        mode = int(rng.integers(5))
        offsets = rng.uniform(-0.6, 0.6, (KINDS[mode], 3, 2)).tolist()
        return {"layout": "cells", "pattern_mode": mode, "offsets_px": offsets}
    colour = rng.choice(["red", "green", "blue"])
    return {
        "layout": "stripe",
        "order": str(rng.choice(["rgb", "bgr"])),
        "origin": f"{colour}-at-pixel-centre",
        "axis": str(rng.choice(["right", "right", "up"])),
    }


NOT_NUMBERS = (math.nan, math.inf, -math.inf, "7", None, [], {}, True, "", [1.0])
Mutation = Callable[[np.random.Generator, dict[str, Any]], str]


def mutated(rng: np.random.Generator, data: dict[str, Any]) -> tuple[dict[str, Any], str]:
    """The data with one thing wrong, and the name of the field that the refusal must have in it."""
    data = copy.deepcopy(data)
    mutation = MUTATIONS[int(rng.integers(len(MUTATIONS)))]
    return data, mutation(rng, data)


def _spoil_number(rng: np.random.Generator, data: dict[str, Any]) -> str:
    section, field = REQUIRED_NUMBERS[int(rng.integers(len(REQUIRED_NUMBERS)))]
    data[section][field] = NOT_NUMBERS[int(rng.integers(len(NOT_NUMBERS)))]
    return field


def _leave_out(rng: np.random.Generator, data: dict[str, Any]) -> str:
    section, field = REQUIRED[int(rng.integers(len(REQUIRED)))]
    del data[section][field]
    return field


def _leave_out_section(rng: np.random.Generator, data: dict[str, Any]) -> str:
    section = str(rng.choice(["panel", "lens", "viewing"]))
    del data[section]
    return section


def _beyond(rng: np.random.Generator, data: dict[str, Any]) -> str:
    section, field, values = BEYOND[int(rng.integers(len(BEYOND)))]
    data[section][field] = values[int(rng.integers(len(values)))]
    return field


def _unknown(rng: np.random.Generator, data: dict[str, Any]) -> str:
    section = str(rng.choice(["panel", "lens", "viewing"]))
    data[section]["colour"] = 1
    return "colour"


def _version(rng: np.random.Generator, data: dict[str, Any]) -> str:
    versions = ("lfd-display/2", "lfd-display", "", 1, None, [])
    data["schema"] = versions[int(rng.integers(len(versions)))]
    return "schema"


def _cells(rng: np.random.Generator, data: dict[str, Any]) -> str:
    """Cells without a pattern mode, or too few of them, or of a shape that is none."""
    pair: list[Any] = [[[0.0, 0.0]] * 3, [[0.1, 0.0]] * 3]
    bad: list[tuple[dict[str, Any], str]] = [
        ({"offsets_px": pair}, "pattern_mode"),
        ({"offsets_px": pair, "pattern_mode": 3}, "offsets_px"),
        ({"offsets_px": [], "pattern_mode": 0}, "offsets_px"),
        ({"offsets_px": [[[0.0, math.nan]] * 3], "pattern_mode": 0}, "offsets_px"),
        ({"offsets_px": pair, "pattern_mode": 5}, "pattern_mode"),
        ({"pattern_mode": 0}, "offsets_px"),
    ]
    cells, field = bad[int(rng.integers(len(bad)))]
    data["panel"]["subpixels"] = {"layout": "cells", **cells}
    return field


def _correction(rng: np.random.Generator, data: dict[str, Any]) -> str:
    bad: list[Any] = [
        [[0.0, 0.0]],
        [[0.0], [0.0]],
        [[0.0, 0.0], [0.0, 0.0, 0.0]],
        7,
        [[1e9] * 2] * 2,
    ]
    data["correction"] = {"phase_lenses": bad[int(rng.integers(len(bad)))]}
    return "phase_lenses"


def _mount(rng: np.random.Generator, data: dict[str, Any]) -> str:
    bad = ({"rotation_deg": 45}, {"rotation_deg": 90.5}, {"rotation_deg": "90"})
    data["panel"]["mount"] = dict(bad[int(rng.integers(len(bad)))])
    return "rotation_deg"


def _date(rng: np.random.Generator, data: dict[str, Any]) -> str:
    data["date"] = str(rng.choice(["yesterday", "2023-02-29", "2024-13-01", "29.2.2024", ""]))
    return "date"


def _metres(_rng: np.random.Generator, data: dict[str, Any]) -> str:
    data["panel"]["size_mm"] = [1e-5 * px for px in data["panel"]["resolution_px"]]
    return "size_mm"


def _pitch(_rng: np.random.Generator, data: dict[str, Any]) -> str:
    """A pitch in metres, in place of the lens count."""
    del data["lens"]["lens_count"]
    width_px, width_mm = data["panel"]["resolution_px"][0], data["panel"]["size_mm"][0]
    data["lens"] |= {"pitch_mm": width_mm / width_px / 1000, "gap_mm": 1.0, "drift": 0.0}
    return "pitch_mm"


REQUIRED_NUMBERS = (
    ("lens", "lens_count"), ("lens", "drift"), ("lens", "center"),
    ("viewing", "views"), ("viewing", "cone_deg"), ("viewing", "distance_mm"),
    ("panel", "resolution_px"), ("panel", "size_mm"),
)  # fmt: skip
REQUIRED = REQUIRED_NUMBERS
BEYOND: tuple[tuple[str, str, tuple[Any, ...]], ...] = (
    ("lens", "lens_count", (0, -3.0, 0.5, 1e9)),
    ("lens", "drift", (11.0, -1e300)),
    ("lens", "center", (1e7, -1e7)),
    ("lens", "index", (0.5, 9.0, 0)),
    ("lens", "gap_mm", (0.0, -1.0)),
    ("lens", "tilt_deg", (90.0, -1000.0)),
    ("viewing", "views", (0, -1, 2.5, 100000)),
    ("viewing", "cone_deg", (0.0, 180.0, -40.0)),
    ("viewing", "distance_mm", (0, -600.0)),
    ("viewing", "spacing", ("even", 1)),
    ("viewing", "inverted", ("yes", 1, 2)),
    ("panel", "resolution_px", ([0, 5], [8, 8, 8], [8.5, 9], "4K", [-1, 4])),
    ("panel", "size_mm", ([0.0, 5.0], [math.inf, 1.0], ["a", "b"])),
    (
        "panel",
        "subpixels",
        ("rgb", [], {"layout": "pentile"}, {"layout": "stripe", "order": "grb"}),
    ),
)
MUTATIONS: tuple[Mutation, ...] = (
    _spoil_number, _leave_out, _leave_out_section, _beyond, _unknown, _version, _cells, _correction,
    _mount, _date, _metres, _pitch,
)  # fmt: skip

"""What a bench measures: groups of contenders that do the same work in turn.

A suite is one table or plot: the paper's Tables 1 (`aa`) and 2 (`supersample`), time against
triangles and against views, speed against error as in EPR's Fig. 6, and all rasterisers (`mvr`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from lfd_render.bench.contenders import Contender
from lfd_render.errors import UsageError

# The paper's scenes and those of their kinds that the project makes.
SCENES = {
    "Sponza": "builtin:atrium",
    "Gallery": "builtin:gallery",
    "Coconut": "builtin:coconuts",
    "Car": "builtin:car",
}
FILTERS = ("none", "spatial", "angular", "both")


@dataclass(frozen=True)
class Group:
    """The same work for several contenders: a scene, so many views, samples a view pixel each way
    and eyes a view; view_size None: as the display has it."""

    suite: str
    scene: str
    views: int
    supersample: tuple[int, int]
    contenders: tuple[Contender, ...]
    view_size: tuple[int, int] | None = None

    @property
    def key(self) -> str:
        """What tells it from all other groups of a run but the contenders."""
        size = "x".join(map(str, self.view_size)) if self.view_size else "default"
        samples = "x".join(map(str, self.supersample))
        return f"{self.suite} {self.scene} {self.views} {samples} {size}"


@dataclass(frozen=True)
class Axes:
    """What is swept. triangles: of built-in scenes, 0 for their own number."""

    scenes: tuple[str, ...] = tuple(SCENES.values())
    techniques: tuple[str, ...] = ()
    aa: tuple[str, ...] = FILTERS
    supersample: tuple[tuple[int, int], ...] = ((2, 1), (1, 2))
    views: tuple[int, ...] = (24, 48, 96)
    triangles: tuple[int, ...] = (100_000, 300_000, 1_000_000, 3_000_000)
    view_sizes: tuple[tuple[int, int], ...] = field(
        default=((240, 180), (360, 270), (480, 360), (720, 540))
    )
    extra: str = ""  # options of built-in scenes, as textures=512
    main_views: int = 48
    main_triangles: int = 0
    main_size: tuple[int, int] | None = None
    rivals: tuple[str, ...] = ()


def scene_source(scene: str, triangles: int, extra: str = "") -> str:
    """A built-in scene with so many triangles (0: its own number) and options it takes."""
    if not scene.startswith("builtin:"):
        return scene
    name, _, query = scene.partition("?")
    items = [item for item in query.split("&") if item]
    if triangles and not any(item.startswith("triangles=") for item in items):
        items.append(f"triangles={triangles}")
    given = {item.partition("=")[0] for item in items}
    textured = name not in ("builtin:car", "builtin:chart", "builtin:spheres")
    if extra and textured and extra.partition("=")[0] not in given:
        items.append(extra)
    return name + ("?" + "&".join(items) if items else "")


def _main(axes: Axes, scene: str) -> str:
    return scene_source(scene, axes.main_triangles, axes.extra)


def _plain(axes: Axes) -> tuple[Contender, ...]:
    return tuple(Contender(name) for name in axes.techniques)


def _filtered(axes: Axes) -> list[Group]:
    """Table 1: each technique, LFDPR with each filter, as the paper has it."""
    contenders = tuple(
        Contender(name, aa)
        for name in axes.techniques
        for aa in axes.aa
        if aa == "none" or not name.startswith("mvr")
    )
    return [
        Group("aa", _main(axes, s), axes.main_views, (1, 1), contenders, axes.main_size)
        for s in axes.scenes
    ]


def _supersampled(axes: Axes) -> list[Group]:
    """Table 2: rasterised views are averaged, points' filtered along what is supersampled."""
    groups = []
    for scene in axes.scenes:
        for fine, eyes in axes.supersample:
            filter_ = "spatial" if fine > 1 else "angular" if eyes > 1 else "none"
            contenders = tuple(
                Contender(name, "none" if name.startswith("mvr") else filter_)
                for name in axes.techniques
            )
            work = (_main(axes, scene), axes.main_views, (fine, eyes))
            groups.append(Group("supersample", *work, contenders, axes.main_size))
    return groups


def _triangles(axes: Axes) -> list[Group]:
    work = (axes.main_views, (1, 1), _plain(axes), axes.main_size)
    return [
        Group("triangles", scene_source(s, n, axes.extra), *work)
        for s in axes.scenes
        for n in axes.triangles
        if s.startswith("builtin:")
    ]


def _views(axes: Axes) -> list[Group]:
    # All views of one size, whatever their number, as S5 and S12 ask.
    size = axes.main_size or (480, 360)
    return [
        Group("views", _main(axes, s), n, (1, 1), _plain(axes), size)
        for s in axes.scenes
        for n in axes.views
    ]


def _error(axes: Axes) -> list[Group]:
    return [
        Group("error", _main(axes, s), axes.main_views, (1, 1), _plain(axes), size)
        for s in axes.scenes
        for size in axes.view_sizes
    ]


def _mvr(axes: Axes) -> list[Group]:
    contenders = tuple(c for c in _plain(axes) if c.rasterises)
    return [
        Group("mvr", _main(axes, s), n, (1, 1), contenders, axes.main_size or (480, 360))
        for s in axes.scenes
        for n in axes.views
    ]


def _rivals(axes: Axes) -> list[Group]:
    """Programs from outside, which render views of one size and weave none."""
    contenders = (*_plain(axes), *(Contender(name) for name in axes.rivals))
    return [
        Group("rivals", _main(axes, s), axes.main_views, (1, 1), contenders,
              axes.main_size or (480, 360))
        for s in axes.scenes
    ]  # fmt: skip


SUITES: dict[str, Callable[[Axes], list[Group]]] = {
    "aa": _filtered,
    "supersample": _supersampled,
    "triangles": _triangles,
    "views": _views,
    "error": _error,
    "mvr": _mvr,
    "rivals": _rivals,
}


def groups_of(suites: Sequence[str], axes: Axes) -> list[Group]:
    """All groups in order. Raises UsageError for an unknown suite."""
    for name in suites:
        if name not in SUITES:
            raise UsageError(f"suite '{name}': unknown; use {', '.join(SUITES)}")
    return [group for name in suites for group in SUITES[name](axes) if group.contenders]

"""What a bench measures: groups of contenders that do the same work in turn.

A suite is one table or plot: the paper's Tables 1 (`aa`) and 2 (`supersample`), time against
triangles and against views, speed against error as in EPR's Fig. 6, and all rasterisers (`mvr`).
Work that several suites show is done once, for all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from lfd_render.bench.applications import APPLICATIONS
from lfd_render.bench.contenders import ALL_MVR, BEST_MVR, IDEAS, PLAIN_MVR, Contender, techniques
from lfd_render.errors import SceneError, UsageError
from lfd_render.scene.builtin import BUILTINS, PREFIX, parse_builtin

# The paper's scenes and those of their kinds that the project makes.
SCENES = {
    "Sponza": "builtin:atrium",
    "Gallery": "builtin:gallery",
    "Coconut": "builtin:coconuts",
    "Car": "builtin:car",
}
RANKING = "mvr"
FILTERS = ("none", "spatial", "angular", "both")


@dataclass(frozen=True)
class Group:
    """The same work for several contenders: a scene, so many views, samples a view pixel each way
    and eyes a view; view_size None: as the display has it. contenders: each with the suites that
    show it."""

    scene: str
    views: int
    supersample: tuple[int, int]
    contenders: Mapping[Contender, tuple[str, ...]]
    view_size: tuple[int, int] | None = None

    @property
    def key(self) -> str:
        """What tells it from all other groups of a run but the contenders."""
        size = "x".join(map(str, self.view_size)) if self.view_size else "default"
        samples = "x".join(map(str, self.supersample))
        application = f" {self.application}" if self.application else ""
        return f"{self.scene} {self.views} {samples} {size}{application}"

    @property
    def suites(self) -> set[str]:
        """All that show some of it."""
        return {suite for suites in self.contenders.values() for suite in suites}

    @property
    def application(self) -> str:
        """What all make instead of a panel image; empty for one."""
        return next((contender.application for contender in self.contenders), "")

    @property
    def eyes(self) -> int:
        """That a frame is seen from."""
        return self.views * self.supersample[1]

    @property
    def ranks(self) -> bool:
        """Whether it only tells which rasterisers others are measured against."""
        return self.suites == {RANKING}

    def with_best(self, best: Sequence[str]) -> Group:
        """With these in place of `mvr:best`; what is named twice is shown by both's suites."""
        found: dict[Contender, tuple[str, ...]] = {}
        for contender, suites in self.contenders.items():
            names = best if contender.technique == BEST_MVR else (contender.technique,)
            for name in names:
                chosen = replace(contender, technique=name)
                found[chosen] = tuple(dict.fromkeys((*found.get(chosen, ()), *suites)))
        return replace(self, contenders=found)


@dataclass(frozen=True)
class Axes:
    """What is swept. triangles: of built-in scenes, besides their own number; views: besides
    main_views; sizes: of views, times the main one."""

    scenes: tuple[str, ...] = tuple(SCENES.values())
    techniques: tuple[str, ...] = ()
    aa: tuple[str, ...] = FILTERS
    supersample: tuple[tuple[int, int], ...] = ((2, 1), (1, 2))
    views: tuple[int, ...] = (24, 96)
    triangles: tuple[int, ...] = (100_000, 300_000, 1_000_000)
    sizes: tuple[float, ...] = (0.5,)
    extra: str = ""  # options of built-in scenes, as textures=512
    main_views: int = 48
    main_triangles: int = 0
    main_size: tuple[int, int] | None = None
    usual_size: tuple[int, int] = (480, 360)  # of main_views upright views, where none is given
    ranked_views: int = 8
    buffer_views: tuple[int, ...] = (4, 16, 32)
    rivals: tuple[str, ...] = ()


def scene_source(scene: str, triangles: int, extra: str = "") -> str:
    """A built-in scene with so many triangles (0: its own number) and options it takes."""
    if not scene.startswith("builtin:"):
        return scene
    name, _, query = scene.partition("?")
    items = [item for item in query.split("&") if item]
    if triangles == _own_triangles(name):
        triangles = 0
    if triangles and not any(item.startswith("triangles=") for item in items):
        items.append(f"triangles={triangles}")
    given = {item.partition("=")[0] for item in items}
    textured = name not in ("builtin:car", "builtin:chart", "builtin:spheres")
    if extra and textured and extra.partition("=")[0] not in given:
        items.append(extra)
    return name + ("?" + "&".join(items) if items else "")


def _own_triangles(name: str) -> int | None:
    builtin = BUILTINS.get(name.removeprefix(PREFIX))
    return builtin.defaults["triangles"] if builtin else None


def _main(axes: Axes, scene: str) -> str:
    return scene_source(scene, axes.main_triangles, axes.extra)


def _group(
    axes: Axes,
    suite: str,
    scene: str,
    contenders: Sequence[Contender],
    *,
    views: int | None = None,
    supersample: tuple[int, int] = (1, 1),
    size: tuple[int, int] | None = None,
) -> Group:
    shown = dict.fromkeys(contenders, (suite,))
    return Group(scene, views or axes.main_views, supersample, shown, size or axes.main_size)


def _plain(axes: Axes) -> tuple[Contender, ...]:
    return tuple(Contender(name) for name in axes.techniques)


def _few(axes: Axes) -> tuple[Contender, ...]:
    """Where the ranking's best take part: without the paper's preset and plain rasterisation, which
    other tables show to be slower."""
    left_out = (PLAIN_MVR, "lfdpr:paper") if BEST_MVR in axes.techniques else ()
    return tuple(c for c in _plain(axes) if c.technique not in left_out)


def _filtered(axes: Axes) -> list[Group]:
    """Table 1: each technique, LFDPR with each filter, as the paper has it; its slow preset with
    none and the last, for only the panel image takes longer."""
    contenders = tuple(
        Contender(name, aa)
        for name in axes.techniques
        for aa in axes.aa
        if aa == "none" or name == "lfdpr" or (name == "lfdpr:paper" and aa == axes.aa[-1])
    )
    return [_group(axes, "aa", _main(axes, s), contenders) for s in axes.scenes]


def _supersampled(axes: Axes) -> list[Group]:
    """Table 2: rasterised views are averaged, points' filtered along what is supersampled."""
    groups = []
    for scene in axes.scenes:
        for fine, eyes in axes.supersample:
            filter_ = "spatial" if fine > 1 else "angular" if eyes > 1 else "none"
            contenders = tuple(
                Contender(name, "none" if name.startswith("mvr") else filter_)
                for name in axes.techniques
                if name != PLAIN_MVR or BEST_MVR not in axes.techniques
            )
            groups.append(
                _group(
                    axes, "supersample", _main(axes, scene), contenders, supersample=(fine, eyes)
                )
            )
    return groups


def _triangles(axes: Axes) -> list[Group]:
    contenders = tuple(c for c in _plain(axes) if c in _few(axes) or c.rasterises)
    return [
        _group(axes, "triangles", scene_source(s, n, axes.extra), contenders)
        for s in axes.scenes
        for n in (axes.main_triangles, *axes.triangles)
        if s.startswith(PREFIX)
    ]


def _views(axes: Axes) -> list[Group]:
    """Upright views of one size, whatever their number: a display's own have as many pixels in
    all as its panel, so that more of them cost no more."""
    size = axes.main_size or axes.usual_size
    return [
        _group(axes, "views", _main(axes, s), _few(axes), views=n, size=size)
        for s in axes.scenes
        for n in (axes.main_views, *axes.views)
    ]


def _error(axes: Axes) -> list[Group]:
    """Smaller views, the main ones, and the same with supersamples."""
    width, height = axes.main_size or axes.usual_size
    sizes = [(round(width * times), round(height * times)) for times in axes.sizes]
    sized = [
        _group(axes, "error", _main(axes, s), _few(axes), size=size)
        for s in axes.scenes
        for size in (axes.main_size, *sizes)
    ]
    return sized + [
        replace(group, contenders=dict.fromkeys(group.contenders, ("error",)))
        for group in _supersampled(axes)
    ]


def _mvr(axes: Axes) -> list[Group]:
    """The ranking with few views, of the size that all others have: the whole catalogue, or what
    is asked for of it."""
    names: Sequence[str] = techniques([ALL_MVR]) if BEST_MVR in axes.techniques else axes.techniques
    # What shades less comes first, for what is far slower than another is not timed to the end.
    names = sorted(names, key=lambda name: not name.endswith("-deferred"))
    contenders = tuple(c for c in map(Contender, names) if c.rasterises)
    size = axes.main_size or axes.usual_size
    return [
        _group(axes, RANKING, _main(axes, s), contenders, views=axes.ranked_views, size=size)
        for s in axes.scenes
    ]


def _applications(axes: Axes) -> list[Group]:
    """Tables 2 to 4 of the catalogue: forward pipelines, for nothing is shaded."""
    size = axes.main_size or axes.usual_size
    return [
        _group(axes, "applications", _main(axes, s),
               [Contender(name, application=application) for name in names], views=n, size=size)
        for application, names in APPLICATIONS.items()
        for s in axes.scenes
        for n in axes.buffer_views
    ]  # fmt: skip


def _ideas(axes: Axes) -> list[Group]:
    """LFDPR's default, each of its ideas changed, the paper's preset and plain rasterisation."""
    ideas = [Contender("lfdpr", idea=idea) for idea in IDEAS if idea != "continuous angles"]
    contenders = [Contender("lfdpr"), *ideas,
                  Contender("lfdpr:paper"), Contender(PLAIN_MVR)]  # fmt: skip
    return [_group(axes, "ideas", _main(axes, s), contenders) for s in axes.scenes]


def _sweep(axes: Axes) -> list[Group]:
    """What filters, supersamples and continuous angles are worth to an eye that moves."""
    plain = [Contender("lfdpr", aa) for aa in axes.aa]
    plain += [Contender("lfdpr", idea=idea) for idea in ("weave linear", "continuous angles")]
    plain.append(Contender(f"{PLAIN_MVR}-deferred"))
    finer = [Contender("lfdpr"), Contender("lfdpr", "spatial")]
    return [
        _group(axes, "sweep", _main(axes, s), plain if times == (1, 1) else finer,
               supersample=times)
        for s in axes.scenes
        for times in ((1, 1), *axes.supersample)
    ]  # fmt: skip


def _rivals(axes: Axes) -> list[Group]:
    """Programs from outside, which render views of one size and weave none."""
    contenders = (*_few(axes), *(Contender(name) for name in axes.rivals))
    return [
        _group(axes, "rivals", _main(axes, s), contenders, size=axes.main_size or axes.usual_size)
        for s in axes.scenes
    ]


SUITES: dict[str, Callable[[Axes], list[Group]]] = {
    RANKING: _mvr,
    "aa": _filtered,
    "supersample": _supersampled,
    "views": _views,
    "error": _error,
    "triangles": _triangles,
    "applications": _applications,
    "ideas": _ideas,
    "sweep": _sweep,
    "rivals": _rivals,
}


def groups_of(suites: Sequence[str], axes: Axes) -> list[Group]:
    """All groups, those of a scene one after another, its ranking first. What several suites ask
    for is one group. Raises UsageError for an unknown suite, SceneError for built-in scenes that
    there are none of."""
    for name in suites:
        if name not in SUITES:
            raise UsageError(f"suite '{name}': unknown; use {', '.join(SUITES)}")
    if BEST_MVR in axes.techniques and not set(suites) <= {"applications", "ideas", "sweep"}:
        suites = (*suites, RANKING)
    found: dict[str, Group] = {}
    for name in (name for name in SUITES if name in suites):
        for group in SUITES[name](axes):
            known = found.setdefault(group.key, group)
            shown = dict(known.contenders)
            for contender, of in group.contenders.items():
                shown[contender] = tuple(dict.fromkeys((*shown.get(contender, ()), *of)))
            if shown:
                found[group.key] = replace(known, contenders=shown)
    for source in dict.fromkeys(group.scene for group in found.values()):
        _check_builtin(source)
    scenes = list(dict.fromkeys(family(s) for s in axes.scenes))
    return sorted(found.values(), key=lambda group: scenes.index(family(group.scene)))


def _check_builtin(source: str) -> None:
    if source.startswith(PREFIX):
        try:
            parse_builtin(source)
        except SceneError as error:
            raise SceneError(f"scene '{source}': {error}") from None


def family(source: str) -> str:
    """A scene without its options."""
    return source.partition("?")[0] if source.startswith(PREFIX) else source

"""What a caller may choose about rendering."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, Literal, get_args

import numpy as np

from lfd_render.display import Reconstruction
from lfd_render.display.model import Spacing
from lfd_render.errors import UsageError
from lfd_render.gpu.layout import LOD_RULES
from lfd_render.panel.stage import LIGHTS
from lfd_render.passes.sampling import (
    CULLINGS,
    DEFAULT_SAMPLING,
    DENSITIES,
    EXACT_SAMPLING,
    LATTICES,
    PAPER_SAMPLING,
    POINT_SOURCES,
    SHADE_PLACES,
    Sampling,
)
from lfd_render.passes.view_buffers import WINNERS
from lfd_render.scene import Environment
from lfd_render.techniques.mvr import DEFAULT_VARIANT, pipeline_of

TECHNIQUES = ("lfdpr", "exact", "mvr")
PRESETS = ("default", "paper", "gold")
PROJECTIONS = ("shear", "general")
ENVIRONMENTS = ("studio", "none")
MOST_VIEWS = 1024
MOST_SEED = 2**32 - 1
MOST_SUPERSAMPLES = 16  # each way
MOST_RADIANCE = 65504.0  # what half floats hold


@dataclass(frozen=True)
class RenderOptions:
    """How to render. technique: lfdpr; exact, by the same slices of triangles, with each pixel
    shaded by its ray; or mvr, each view rasterised. view_size: upright views of (width, height);
    None: views that follow the lenses, with as many rows as makes all views together as large as
    the panel. mvr: which variant
    of technique mvr, one of `techniques.mvr.VARIANTS`. projection: how
    points reach the views, by the shear that parallel views share or by each view's own matrix.
    splat: how a pixel's nearest point is found, by 64-bit atomics, by two passes of 32-bit ones or
    by work groups that own their pixels, with the same picture; auto: what suits the device.
    environment: the built-in studio, none, or a picture, turned about the world's +y,
    counter-clockwise seen from above, and scaled.
    lod: how textures are filtered, one of LOD_RULES; None: as the preset has it (`lod_rule`).
    lattice, point_source, density, texture_limit, culling, stochastic_culling, shade: the ideas of
    LFDPR, each as `Sampling` says; None: as the preset has them (`sampling`).
    effort: count what points try and keep in the last frame, which takes about a frame's time.
    counted: count the last frame's points, which takes about as long as making them; without it the
    report does not say when nothing can be seen.
    views: how many, or "continuous": each subpixel at its own angle, to 1/16 of a view interval.
    lookup, weave, aa: how views become the panel image, as `Reconstruction` has it; aa None: as the
    preset has it (`filter`). aa_light: whether filters average "linear" light or "encoded" pixels.
    supersample: rendered pixels a view pixel each way, and eyes a view, at random places in its
    interval by `seed`; averaged, or filtered where aa is spatial. linear: whether `Eia.linear` is
    asked for; without it nearest views are woven faster."""

    views: int | Literal["continuous"] | None = None
    view_size: tuple[int, int] | None = None
    technique: str = "lfdpr"
    mvr: str = DEFAULT_VARIANT
    preset: str = "default"
    spacing: Spacing | None = None
    seed: int = 0
    repeat: int = 1
    background: tuple[float, float, float] = (0.0, 0.0, 0.0)
    exposure: float = 1.0
    projection: str = "shear"
    splat: str = "auto"
    environment: str | Environment = "studio"
    environment_turn_rad: float = 0.0
    environment_intensity: float = 1.0
    lod: str | None = None
    lattice: str | None = None
    point_source: str | None = None
    density: str | None = None
    texture_limit: bool | None = None
    culling: str | None = None
    stochastic_culling: bool | None = None
    shade: str | None = None
    effort: bool = False
    counted: bool = True
    lookup: str = "lens"
    weave: str = "nearest"
    aa: str | None = None
    aa_light: str = "linear"
    supersample: tuple[int, int] = (1, 1)
    linear: bool = True

    def __post_init__(self) -> None:
        """Check ranges; raises UsageError."""
        self._check_types()
        for name, choice, choices in (
            ("technique", self.technique, TECHNIQUES),
            ("preset", self.preset, PRESETS),
            ("projection", self.projection, PROJECTIONS),
            ("lod", self.lod_rule, LOD_RULES),
            ("lattice", self.sampling.lattice, LATTICES),
            ("point source", self.sampling.source, POINT_SOURCES),
            ("density", self.sampling.density, DENSITIES),
            ("culling", self.sampling.culling, CULLINGS),
            ("shade", self.sampling.shade, SHADE_PLACES),
        ):
            if choice not in choices:
                raise UsageError(f"{name} '{choice}': unknown; use {' or '.join(choices)}")
        if self.lod == "multiview" and self.technique != "lfdpr":
            others = " or ".join(rule for rule in LOD_RULES if rule != "multiview")
            raise UsageError(
                f"lod 'multiview': {self.technique} has no points that views share; use {others}"
            )
        pipeline_of(self.mvr)  # which checks it
        if self.mvr != DEFAULT_VARIANT and self.technique != "mvr":
            raise UsageError(
                f"mvr '{self.mvr}': technique '{self.technique}' rasterises no views; "
                "use it with technique mvr"
            )
        self._check_sampling()
        self._check_splat()
        self._check_views()
        self._check_panel()
        size = self.view_size
        if size is not None and not (
            isinstance(size, tuple | list)
            and len(size) == 2
            and all(_whole(n, 16384) for n in size)
        ):
            raise UsageError(
                f"view size: {size!r} is out of range; use two whole numbers, 1 to 16384 a side"
            )
        if len(self.background) != 3 or not all(0 <= c <= MOST_RADIANCE for c in self.background):
            raise UsageError(
                f"background: {self.background}; use three numbers from 0 to {MOST_RADIANCE:g}"
            )
        if self.repeat < 1:
            raise UsageError(f"repeat: {self.repeat} is out of range; use 1 or more")
        if not 0.0 < self.exposure < np.inf:
            raise UsageError(f"exposure: {self.exposure} is out of range; use a positive number")
        if not isinstance(self.environment, Environment) and self.environment not in ENVIRONMENTS:
            raise UsageError(
                f"environment {self.environment!r}: unknown; use {', '.join(ENVIRONMENTS)} or "
                "an Environment"
            )
        if not np.isfinite(self.environment_turn_rad):
            raise UsageError(
                f"environment turn: {self.environment_turn_rad}; use a finite number of radians"
            )
        if not 0.0 <= self.environment_intensity <= MOST_RADIANCE:
            raise UsageError(
                f"environment intensity: {self.environment_intensity} is out of range; "
                f"use a number from 0 to {MOST_RADIANCE:g}"
            )

    def _check_types(self) -> None:
        """Raise UsageError for what is of another kind than the fields' own."""
        wanted = {
            "exposure": (_is_number, "a number"),
            "environment_turn_rad": (_is_number, "a number"),
            "environment_intensity": (_is_number, "a number"),
            "seed": (_is_seed, f"0 to {MOST_SEED}"),
            "repeat": (_is_whole, "a whole number"),
            "background": (
                lambda c: isinstance(c, tuple | list) and all(map(_is_number, c)),
                "three numbers",
            ),
            "spacing": (lambda s: s in (None, *get_args(Spacing)), "lens, angle, tangent or None"),
            "texture_limit": (_is_flag, "True, False or None"),
            "stochastic_culling": (_is_flag, "True, False or None"),
            "effort": (_is_flag, "True or False"),
            "counted": (_is_flag, "True or False"),
        }
        for name, (fits, remedy) in wanted.items():
            value = getattr(self, name)
            if not fits(value):
                raise UsageError(f"{name.replace('_', ' ')}: {value!r}; use {remedy}")

    @property
    def lod_rule(self) -> str:
        """The rule of LOD_RULES in use: the preset's where none is given. The paper filters LFDPR's
        textures by multiview mipmapping (section 3.3) and those of MVR as hardware does."""
        if self.lod is not None:
            return self.lod
        if self.preset == "paper":
            return "multiview" if self.technique == "lfdpr" else "long-axis"
        return "anisotropic"

    @property
    def sampling(self) -> Sampling:
        """The preset's sampling, with what was chosen apart from it; exact has one alone."""
        if self.technique == "exact":
            return EXACT_SAMPLING
        preset = PAPER_SAMPLING if self.preset == "paper" else DEFAULT_SAMPLING
        if self.lattice == "rows" and self.point_source is None:
            preset = replace(preset, source="compute")  # the only one that rows have
        elif self.point_source == "raster" and self.lattice is None:
            preset = replace(preset, lattice="paper")
        lattice = self.lattice or preset.lattice
        if self.preset == "default" and lattice == "rows":
            preset = replace(preset, shade="auto")
        chosen: dict[str, Any] = {
            "lattice": self.lattice,
            "source": self.point_source,
            "density": self.density,
            "texture_limit": self.texture_limit,
            "culling": self.culling,
            "stochastic_culling": self.stochastic_culling,
            "shade": self.shade,
        }
        return replace(preset, **{k: v for k, v in chosen.items() if v is not None})

    def _check_sampling(self) -> None:
        sampling = self.sampling
        if sampling.source == "raster" and sampling.lattice == "rows":
            raise UsageError(
                "point source 'raster': rows are cut in compute; use it with lattice 'paper'"
            )
        if sampling.shade == "shared" and sampling.lattice == "paper":
            raise UsageError(
                "shade 'shared': what rows cut from triangles is shaded; use it with lattice 'rows'"
            )
        if self.projection == "general" and sampling.lattice == "paper":
            raise UsageError(
                "projection 'general': cells of lattice 'paper' are splatted by the shear; use it "
                "with lattice 'rows'"
            )
        given = [
            name
            for name in (
                "lattice", "point_source", "density", "texture_limit", "culling",
                "stochastic_culling", "shade",
            )
            if getattr(self, name) is not None
        ]  # fmt: skip
        if self.technique == "exact":
            if self.shade not in (None, "auto", "ray"):
                raise UsageError(
                    f"shade '{self.shade}': technique 'exact' shades each pixel by its ray; "
                    "use it with lfdpr"
                )
            given = [name for name in given if name != "shade"]
        if given and self.technique != "lfdpr":
            raise UsageError(
                f"{given[0].replace('_', ' ')} {getattr(self, given[0])!r}: technique "
                f"'{self.technique}' has no points; use it with lfdpr"
            )

    @property
    def filter(self) -> str:
        """The filter in use: the preset's where none is given."""
        if self.aa is not None:
            return self.aa
        return "spatial" if self.preset == "gold" else "none"

    def _check_views(self) -> None:
        if self.views not in (None, "continuous") and not _whole(self.views, MOST_VIEWS):
            raise UsageError(
                f"views: {self.views!r} is out of range; use 1 to {MOST_VIEWS}, or 'continuous'"
            )
        samples = self.supersample
        if not (
            isinstance(samples, tuple | list)
            and len(samples) == 2
            and all(_whole(n, MOST_SUPERSAMPLES) for n in samples)
        ):
            raise UsageError(
                f"supersample: {samples!r} is out of range; use two whole numbers, 1 to "
                f"{MOST_SUPERSAMPLES}: pixels each way, and eyes a view"
            )
        if self.views == "continuous" and samples[1] > 1:
            raise UsageError(
                f"supersample: {samples[1]} eyes a view, but continuous views have an eye for "
                "every angle; use 1"
            )

    def _check_panel(self) -> None:
        Reconstruction(self.lookup, self.weave, self.filter)  # which checks them
        if self.aa_light not in LIGHTS:
            raise UsageError(f"aa light '{self.aa_light}': unknown; use {' or '.join(LIGHTS)}")

    def _check_splat(self) -> None:
        if self.splat not in WINNERS:
            raise UsageError(f"splat '{self.splat}': unknown; use {', '.join(WINNERS)}")
        if self.splat == "owned" and self.projection == "general":
            raise UsageError(
                "splat 'owned': needs projection 'shear', whose views share their rows; "
                "with 'general' use auto"
            )
        if self.splat == "owned" and self.sampling.lattice == "paper":
            raise UsageError(
                "splat 'owned': cells of lattice 'paper' lie on no rows; use auto, two-pass or "
                "int64"
            )
        if self.splat != "auto" and self.technique == "mvr":
            raise UsageError(
                f"splat '{self.splat}': technique 'mvr' does not splat; use it with lfdpr or exact"
            )


def choose(views: int | Literal["continuous"] | None, options: dict[str, Any]) -> RenderOptions:
    """Options from a call's keywords. Raises UsageError for a name that is none."""
    names = [field.name for field in fields(RenderOptions) if field.name != "views"]
    for name in options:
        if name not in names:
            raise UsageError(f"option '{name}': unknown; use {', '.join(names)}")
    return RenderOptions(views=views, **options)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)


def _is_whole(value: object) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def _is_seed(value: object) -> bool:
    return (
        isinstance(value, int | np.integer)
        and not isinstance(value, bool)
        and 0 <= int(value) <= MOST_SEED
    )


def _is_flag(value: object) -> bool:
    return value is None or isinstance(value, bool | np.bool_)


def _whole(value: object, most: int) -> bool:
    return isinstance(value, int | np.integer) and 1 <= int(value) <= most

"""The catalogue of multi-view rasterisation (Unterguggenberger et al. 2020), in its notation.

P(invocations, amplification, framebuffer, culling and clipping), for N views:

→ direct forwarding · ≡ instanced rendering · ⋈ geometry shader loop · ⇀ geometry shader
invocations · ≈ OVR_multiview. □-□ a framebuffer a view · ⊞ one, partitioned · ⊟ one, layered ·
⊞-⊞, ⊟-⊟ several of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfd_render.gpu.device import MULTIVIEW, Device

LAYERS = "GL_ARB_shader_viewport_layer_array"
# Floats that the geometry stage emits a corner: position, clip distances, layer and id; with those
# of raster/corner.glsl.
BARE = 8
SHADED = BARE + 19
_SYMBOLS = {
    "multipass": "→",
    "instanced": "≡",
    "loop": "⋈",
    "invocations": "⇀",
    "multiview": "≈",
}


@dataclass(frozen=True)
class Pipeline:
    """How N views are rasterised.

    amplification: what makes copies of the geometry for the views of a pass, a key of _SYMBOLS.
    at_once: views a pass, 0 for all. partitioned: whether views are parts of one texture, else
    layers, or each by itself where a pass has one. clipping: what keeps parts apart: "viewport",
    "planes" or "fragments". culling: in the geometry stage, of "frustum" and "backface".
    """

    amplification: str
    at_once: int = 0
    partitioned: bool = False
    clipping: str = ""
    culling: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """How options call it: loop-4-partitioned, …"""
        usual = ("frustum", "backface") if self.geometry and not self.partitioned else None
        parts = [self.amplification]
        if self.at_once and self.amplification != "multipass":
            parts.append(str(self.at_once))
        if self.partitioned:
            parts.append("partitioned")
        elif usual and self.culling != usual:
            parts.append("+".join(self.culling) or "unculled")
        return "-".join(parts)

    @property
    def notation(self) -> str:
        """P(…), as the catalogue writes it."""
        passes = {0: "1", 1: "N"}.get(self.at_once, f"⌈N/{self.at_once}⌉")
        one = "⊞" if self.partitioned else "⊟"
        layout = one if self.at_once == 0 else f"{one}-{one}"
        if self.at_once == 1:
            layout = "⊞" if self.partitioned else "□-□"
        steps = [{"frustum": "VFC_GS", "backface": "BFC_GS"}[c] for c in self.culling]
        clip = {"viewport": "CLIP_VP", "planes": "CLIP_||", "fragments": "CLIP_FS"}
        steps += [clip[self.clipping]] if self.clipping else []
        inside = [passes, _SYMBOLS[self.amplification], layout, "|".join(steps)]
        return f"P({', '.join(filter(None, inside))})"

    @property
    def geometry(self) -> bool:
        """Whether a geometry stage amplifies."""
        return self.amplification in ("loop", "invocations")

    @property
    def layered(self) -> bool:
        """Whether draws choose a layer of the target."""
        return not self.partitioned and self.at_once != 1

    def views_a_pass(self, views: int) -> int:
        """How many of so many views a pass draws."""
        return min(self.at_once or views, views)

    def passes(self, views: int) -> list[range]:
        """The views of each pass. Where all passes must be as long the last reaches back."""
        step = self.views_a_pass(views)
        if self.amplification == "multiview":
            return [
                range(min(first, views - step), min(first + step, views))
                for first in range(0, views, step)
            ]
        return [range(first, min(first + step, views)) for first in range(0, views, step)]

    def problem(self, device: Device, views: int, *, components: int = SHADED) -> str | None:
        """Why a device cannot draw so many views this way, and what would do; None if it can.

        components: floats that the geometry stage emits a corner, SHADED or BARE.
        """
        info, at_once = device.info, self.views_a_pass(views)
        if self.amplification == "multiview":
            if not info.max_multiview:
                return f"{device.name} lacks {MULTIVIEW}; use loop-4, instanced-4 or multipass"
            if at_once > info.max_multiview:
                return f"{device.name} draws {info.max_multiview} views at once; use multiview-2"
            if views < self.at_once:
                return f"{views} views are fewer than the {self.at_once} of a pass; use multipass"
        if self.amplification == "instanced" and self.layered and LAYERS not in info.extensions:
            return (
                f"{device.name} lacks {LAYERS}, by which vertices choose layers; "
                "use instanced-partitioned or loop-4"
            )
        return self._geometry_problem(device, at_once, components) if self.geometry else None

    def _geometry_problem(self, device: Device, at_once: int, components: int) -> str | None:
        info = device.info
        if not info.geometry_storage:
            return f"the geometry stage of {device.name} has too few storage blocks; use multipass"
        corners = min(info.max_geometry_vertices, info.max_geometry_components // components)
        if self.amplification == "loop" and 3 * at_once > corners:
            return (
                f"the geometry stage of {device.name} emits {corners // 3} such triangles at most, "
                f"not {at_once}; use loop-4"
            )
        if self.amplification == "invocations" and at_once > info.max_geometry_invocations:
            return (
                f"the geometry stage of {device.name} runs {info.max_geometry_invocations} times "
                f"a triangle at most, not {at_once}; use invocations-4"
            )
        return None


_BOTH = ("frustum", "backface")
PIPELINES: dict[str, Pipeline] = {
    pipeline.name: pipeline
    for pipeline in (
        Pipeline("multipass", 1),
        Pipeline("multipass", 1, partitioned=True, clipping="viewport"),
        Pipeline("instanced"),
        Pipeline("instanced", 4),
        Pipeline("instanced", partitioned=True, clipping="planes"),
        Pipeline("instanced", 4, partitioned=True, clipping="planes"),
        Pipeline("loop", partitioned=True, clipping="fragments", culling=("frustum",)),
        Pipeline("loop", 4, partitioned=True, clipping="fragments", culling=("frustum",)),
        Pipeline("loop", culling=("frustum",)),
        Pipeline("loop", culling=_BOTH),
        Pipeline("loop", 1, culling=_BOTH),
        Pipeline("loop", 4),
        Pipeline("loop", 4, culling=("frustum",)),
        Pipeline("loop", 4, culling=_BOTH),
        Pipeline("invocations", culling=("frustum",)),
        Pipeline("invocations", culling=_BOTH),
        Pipeline("invocations", 1, culling=_BOTH),
        Pipeline("invocations", 4),
        Pipeline("invocations", 4, culling=("frustum",)),
        Pipeline("invocations", 4, culling=_BOTH),
        Pipeline("multiview", 2),
        Pipeline("multiview", 4),
    )
}
PLAIN = PIPELINES["multipass"]


@dataclass(frozen=True)
class Parts:
    """Where the views of a pipeline lie in its textures: `across` by so many rows as it takes of
    parts of `columns` × `rows` pixels, `a_layer` of them a layer."""

    columns: int
    rows: int
    views: int
    across: int
    a_layer: int

    @classmethod
    def of(cls, pipeline: Pipeline, views: int, columns: int, rows: int) -> Parts:
        """Parts of a pipeline's target, nearly square where they share a layer."""
        a_layer = 1
        if pipeline.partitioned:
            a_layer = views if pipeline.at_once == 1 else pipeline.views_a_pass(views)
        across = max(1, min(a_layer, round((a_layer * rows / columns) ** 0.5)))
        return cls(columns, rows, views, across, a_layer)

    @property
    def size(self) -> tuple[int, int, int]:
        """Width, height and layers of the textures."""
        down = -(-self.a_layer // self.across)
        return self.across * self.columns, down * self.rows, -(-self.views // self.a_layer)

    def split(self, pixels: NDArray[Any]) -> NDArray[Any]:
        """Views [view, row, column, …] of textures [layer, y, x, …]."""
        views = np.empty((self.views, self.rows, self.columns, *pixels.shape[3:]), pixels.dtype)
        for view in range(self.views):
            x, y, layer = self.corner(view)
            views[view] = pixels[layer, y : y + self.rows, x : x + self.columns]
        return views

    def corner(self, view: int) -> tuple[int, int, int]:
        """Column, row and layer of a view's first pixel."""
        layer, part = divmod(view, self.a_layer)
        return part % self.across * self.columns, part // self.across * self.rows, layer

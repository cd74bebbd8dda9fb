"""How surfaces are sampled: each idea of LFDPR and its predecessors, to be switched by itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.scene_buffers import Batch
from lfd_render.passes.view_target import Band

if TYPE_CHECKING:
    from lfd_render.passes.view_buffers import ViewBuffers

LATTICES = ("rows", "paper")
POINT_SOURCES = ("compute", "raster")
DENSITIES = ("lfd", "isotropic")
CULLINGS = ("exact", "vertices")
SHADE_PLACES = ("auto", "ray", "shared", "point")


@dataclass(frozen=True)
class Sampling:
    """Equations and sections are those of Gavane and Watson 2024, EPR is theirs of 2023.

    lattice: points on the rows that all views share, or the paper's lattice in each triangle's own
    plane (section 3.1). source: made in compute or by the paper's vertex, geometry and fragment
    stages, which need the paper's lattice. density: along each axis what that axis needs
    (LFD-biased), or on both what the denser one needs. texture_limit: equations 1–3.
    culling: exact, or by vertices in frusta enlarged by a fifth (EPR section 3.1), which loses
    triangles. stochastic_culling: of triangles below a tenth of a pixel (EPR section 3.2), which
    punches holes. shade: where a pixel's ray meets the surface; or shared, what does not depend on
    the eye once for the views that see it alike; or at the point that owns the pixel, one colour a
    splat and view, as in the paper; auto: shared where that takes less time (`share.pays`).
    """

    lattice: str = "rows"
    source: str = "compute"
    density: str = "lfd"
    texture_limit: bool = True
    culling: str = "exact"
    stochastic_culling: bool = False
    shade: str = "ray"

    def constants(self) -> dict[str, int]:
        """Macros of the shaders that sample, splat or shade points."""
        return {
            "ISOTROPIC": int(self.density == "isotropic"),
            "TEXTURE_LIMIT": int(self.texture_limit),
            "VERTEX_CULLING": int(self.culling == "vertices"),
            "STOCHASTIC_CULLING": int(self.stochastic_culling),
            "SHADE_AT_POINT": int(self.shade == "point"),
            "PAPER_LATTICE": int(self.lattice == "paper"),
        }


DEFAULT_SAMPLING = Sampling()
# Slice tracks alone: nothing depends on how dense points are, and each pixel is shaded by its ray.
EXACT_SAMPLING = Sampling(texture_limit=False)
PAPER_SAMPLING = Sampling(
    lattice="paper",
    source="raster",
    culling="vertices",
    stochastic_culling=True,
    shade="point",
)


class Points(Protocol):
    """The points of one batch and band, window by window."""

    @property
    def windows(self) -> int:
        """How many windows there are; one is filled at a time."""
        ...

    @property
    def sizes(self) -> Buffer:
        """Size of a triangle's points, two words [triangle]; see shaders/shade/point.glsl."""
        ...

    def splat_blocks(self) -> dict[str, Buffer]:
        """What splatting reads of the window filled last, by block name."""
        ...

    def release(self) -> None:
        """Free the buffers."""
        ...


class PointSource(Protocol):
    """Batch, Band → Points. It takes only points that it allocated itself, hence Any."""

    def allocate(self, batch: Batch) -> Any:
        """Buffers for a batch's points, too small until `fit` enlarges them."""
        ...

    def __call__(self, batch: Batch, points: Any, band: Band) -> None:
        """Sample one batch and band: all but the points themselves."""
        ...

    def fill(self, batch: Batch, points: Any, band: Band, window: int) -> None:
        """Write the points of one window."""
        ...

    def fit(self, points: Any) -> bool:
        """Make room for what frames since the last call needed; whether there was too little."""
        ...

    def count(self, batch: Batch, points: Any, band: Band) -> int:
        """Points of a batch and band that was sampled last, and filled if it is one window;
        counted outside a frame."""
        ...

    def release(self) -> None:
        """Free the kernels."""
        ...


class Splatter(Protocol):
    """Points → ViewBuffers, in steps that each go over all points."""

    steps: range

    def __call__(
        self, step: int, batch: Batch, points: Any, *, window: int, band: Band, views: ViewBuffers
    ) -> None:
        """Splat the window filled last."""
        ...

    def release(self) -> None:
        """Free the kernels."""
        ...

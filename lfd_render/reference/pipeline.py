"""The whole way: scene → views → panel image, each step by its definition."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Camera, DisplayProfile, Rig, ViewGrid
from lfd_render.reference.encode import encoded
from lfd_render.reference.owners import Owner, owner_rays
from lfd_render.reference.raster import Visibility, visible
from lfd_render.reference.shade import Shading, opaque_at, points_at, seen_by_all
from lfd_render.reference.transform import placed
from lfd_render.reference.weave import woven
from lfd_render.scene import Scene

Float64 = NDArray[np.float64]
Color = tuple[float, float, float]
BLACK: Color = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Views:
    """linear: float64 [view, row, column, rgb]; solid, blended: what each pixel shows of either."""

    linear: Float64
    solid: Visibility
    blended: Visibility


def render_views(
    scene: Scene,
    rig: Rig,
    grid: ViewGrid,
    display_from_world: Float64,
    *,
    background: Color = BLACK,
    lod: str = "area",
) -> Views:
    """All views of a scene. display_from_world: float64 [4, 4], as `Camera.display_from_world`.

    lod: the rule by which textures are filtered, as `textures.filtered` has it.

    Of blended surfaces the nearest lies over what is solid; those behind it do not show.
    """
    triangles = placed(scene, display_from_world)
    inverse = np.linalg.inv(display_from_world).astype(np.float64)
    shading = Shading(scene, triangles, inverse, lod=lod)
    accepts = opaque_at(shading, rig, grid)
    solid = visible(triangles, rig, grid, accepts)
    blended = visible(triangles, rig, grid, accepts, over=solid)
    linear = np.empty((rig.views, grid.rows, grid.columns, 3))
    linear[...] = background
    shade_over(linear, shading, solid, rig, grid)
    shade_over(linear, shading, blended, rig, grid)
    return Views(linear, solid, blended)


def shade_over(
    linear: Float64,
    shading: Shading,
    shown: Visibility,
    rig: Rig,
    grid: ViewGrid,
    *,
    owner: Owner | None = None,
) -> None:
    """Lay what pixels show over view images [view, row, column, rgb], in place.

    owner: which points are shaded, instead of where the pixels' rays hit.
    """
    pixels, ids = shown.shown()
    through = (
        owner_rays(owner, shading.triangles, rig, grid, ids=ids, pixels=pixels) if owner else None
    )
    points = points_at(shading.triangles, rig, grid, ids, pixels, through=through)
    if shading.lod == "multiview":
        cell_mm2 = owner.cell_mm2 if owner else None
        points = seen_by_all(points, shading, rig, grid, pixels.view, cell_mm2=cell_mm2)
    colors = shading.colors(points, rig.eye_x_mm[pixels.view], rig.distance_mm)
    opacity = np.where(shading.triangles.blended[ids], shading.alpha(points), 1.0)[:, None]
    at = (pixels.view, pixels.row, pixels.column)
    linear[at] = opacity * colors + (1.0 - opacity) * linear[at]


def render_eia(
    scene: Scene,
    profile: DisplayProfile,
    camera: Camera,
    *,
    rig: Rig | None = None,
    grid: ViewGrid | None = None,
    background: Color = BLACK,
    exposure: float = 1.0,
    lod: str = "area",
) -> NDArray[np.uint8]:
    """The panel image, uint8 [y, x, rgb]; by default with the profile's views along its lenses."""
    rig = profile.rig() if rig is None else rig
    if grid is None:
        grid = ViewGrid.lens(profile, ViewGrid.default_rows(profile, rig.views))
    display_from_world = camera.display_from_world(profile.size_mm)
    views = render_views(scene, rig, grid, display_from_world, background=background, lod=lod)
    return encoded(woven(views.linear, profile, grid), exposure)

"""The colour of a view pixel: where its ray meets the triangle, glTF metallic-roughness there.

glTF 2.0 specification, appendix B (BRDF implementation), under an environment, by default the
studio, and the scene's lights; the studio's key light shines only without any. Derivatives are
those of the barycentric weights: with α, β, γ linear in the window point (see `raster`), the weight
of a corner is α/(α + β + γ), and its derivative follows by the quotient rule.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Rig, ViewGrid
from lfd_render.reference import studio
from lfd_render.reference.environment import Environment
from lfd_render.reference.lights import Arrival, arriving
from lfd_render.reference.points import densest_pixel_mm2, point_columns
from lfd_render.reference.raster import Accepts, Pixels, Rays, faces, meet, rays
from lfd_render.reference.textures import Footprints, among_views, filtered, mip_chain
from lfd_render.reference.transform import Triangles, points_by, unit
from lfd_render.scene import Material, Scene
from lfd_render.scene.findings import UV_ROUNDING

Float64 = NDArray[np.float64]
Int = NDArray[np.int64]
Bool = NDArray[np.bool_]

SMALLEST_ALPHA = 0.002  # GGX α of the smoothest surface, which keeps its highlight finite
LEAST_ALPHA = 1 / 255  # of blended texels that show
LEAST_SINE = 2e-6  # between changes of texture coordinates that are not one line
SRGB_ROLES = ("base_color_texture", "emissive_texture")


@dataclass(frozen=True, eq=False)
class Points:
    """Where rays meet their triangles, [pixel, …]; dx is over a column, dy over a row downward."""

    ids: Int
    weights: Float64  # [pixel, corner]
    weights_dx: Float64
    weights_dy: Float64
    p_display: Float64  # [pixel, xyz]
    p_display_dx: Float64
    p_display_dy: Float64
    back: Bool  # seen from behind
    views: Float64  # [pixel, 3], see Footprints

    def blend(self, at_corners: Float64) -> Float64:
        """Values of the pixels' own corners [pixel, corner, …], at the pixels."""
        blended: Float64 = np.einsum("nc,nc...->n...", self.weights, at_corners)
        return blended


def points_at(
    triangles: Triangles,
    rig: Rig,
    grid: ViewGrid,
    ids: Int,
    pixels: Pixels,
    *,
    through: Rays | None = None,
) -> Points:
    """Points of pixels [pixel] on the triangles that ids [pixel] name.

    through: other rays than those of the pixels' centres.
    """
    corners = triangles.p_display[ids]
    meeting = meet(corners, through or rays(rig, grid, pixels), rig.distance_mm)
    whole = meeting.volumes.sum(axis=-1, keepdims=True)
    weights = meeting.weights
    # Volumes grow with the window point by their normals; a row leads downward.
    by_x = meeting.normals[..., 0] * grid.column_mm
    by_y = -meeting.normals[..., 1] * grid.panel_mm[1] / grid.rows
    weights_dx = (by_x - weights * by_x.sum(axis=-1, keepdims=True)) / whole
    weights_dy = (by_y - weights * by_y.sum(axis=-1, keepdims=True)) / whole
    p_display, p_dx, p_dy = (
        np.einsum("nc,ncx->nx", w, corners) for w in (weights, weights_dx, weights_dy)
    )
    back = ~faces(meeting.whole, triangles.mirrored[ids], double_sided=False)
    alone = np.tile([1.0, 1.0, 0.0], (len(ids), 1))
    return Points(ids, weights, weights_dx, weights_dy, p_display, p_dx, p_dy, back, alone)


def seen_by_all(
    points: Points,
    shading: Shading,
    rig: Rig,
    grid: ViewGrid,
    view: Int,
    *,
    cell_mm2: Callable[[int], float] | None = None,
) -> Points:
    """Points [pixel] with what their footprints are in all views; view: each pixel's own.

    cell_mm2: area of a triangle's points, where they are not those of rows.
    """
    triangles, scene = shading.triangles, shading.scene
    areas = np.stack(
        [pixel_areas_mm2(points, triangles, rig, grid, eye) for eye in rig.eye_x_mm], axis=1
    )
    own = areas[np.arange(len(view)), view]
    splat = np.empty(len(view))
    for index in np.unique(points.ids).tolist():
        corners = triangles.p_display[index]
        at = points.ids == index
        if cell_mm2 is not None:
            splat[at] = cell_mm2(index)
            continue
        # One point's cell: so many pixels of the eye that sees the plane densest.
        depth = rig.distance_mm - points.p_display[at, 2]
        nearest = max(rig.near_mm, rig.distance_mm - corners[:, 2].max())
        pixel = densest_pixel_mm2(corners, rig, grid) * (depth / nearest) ** 3
        splat[at] = pixel * point_columns(scene, triangles, index, rig, grid)
    drawn = np.stack([_drawn(points, triangles, rig, eye) for eye in rig.eye_x_mm], axis=1)
    views = among_views(np.where(drawn, areas, np.nan), own, splat)
    return replace(points, views=views)


def pixel_areas_mm2(
    points: Points, triangles: Triangles, rig: Rig, grid: ViewGrid, eye_mm: float
) -> Float64:
    """What a pixel of an eye covers around points [pixel] on their triangles' planes, mm²: two
    steps on the window, carried to the plane."""
    corners = triangles.p_display[points.ids]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    ray = points.p_display - (eye_mm, 0.0, rig.distance_mm)
    t = -ray[:, 2:] / rig.distance_mm
    steps = []
    for step in ((grid.column_mm, 0.0, 0.0), (0.0, -grid.panel_mm[1] / grid.rows, 0.0)):
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (normal @ step / _dot(normal, ray))[:, None]
            steps.append(np.asarray(t * (np.array(step) - ray * along), np.float64))
    with np.errstate(invalid="ignore"):
        return np.asarray(np.linalg.norm(np.cross(steps[0], steps[1]), axis=-1))


def _drawn(points: Points, triangles: Triangles, rig: Rig, eye_mm: float) -> Bool:
    """Whether an eye sees a side that is drawn of the triangles of points."""
    corners = triangles.p_display[points.ids]
    from_eye = corners - (eye_mm, 0.0, rig.distance_mm)
    whole = _dot(from_eye[:, 0], np.cross(from_eye[:, 1], from_eye[:, 2]))
    ids = points.ids
    return faces(whole, triangles.mirrored[ids], triangles.double_sided[ids])


class Shading:
    """Materials of a scene, ready to colour points. Mip chains are made once an image.

    lod: the rule by which textures are filtered, as `filtered` has it."""

    def __init__(
        self,
        scene: Scene,
        triangles: Triangles,
        world_from_display: Float64,
        environment: Environment = studio,
        *,
        lod: str = "area",
    ) -> None:
        self.scene = scene
        self.triangles = triangles
        self.world_from_display = world_from_display
        self.environment = environment
        self.lod = lod
        self._chains: dict[tuple[int, bool], list[Float64]] = {}

    def colors(self, points: Points, eyes_mm: Float64, distance_mm: float) -> Float64:
        """Scene-linear light [pixel, rgb] that points send to eyes at (eyes_mm, 0, distance_mm)."""
        eye_display = np.stack(
            [eyes_mm, np.zeros_like(eyes_mm), np.full_like(eyes_mm, distance_mm)], axis=-1
        )
        eye_world = points_by(self.world_from_display, eye_display)
        colors = np.zeros((len(points.ids), 3))
        for index in np.unique(self.triangles.material[points.ids]):
            chosen = self.triangles.material[points.ids] == index
            part = Points(**{name: field[chosen] for name, field in vars(points).items()})
            surface = Surface(self, self.scene.materials[index], part)
            colors[chosen] = surface.radiance(eye_world[chosen])
        return colors

    def coverage(self, points: Points) -> Float64:
        """Alpha [pixel] that decides whether points count: filtered by one tap and for one view,
        so by `area` where the rule takes more."""
        rule = "area" if self.lod in ("multiview", "anisotropic") else self.lod
        return self.alpha(points, rule)

    def alpha(self, points: Points, lod: str | None = None) -> Float64:
        """Opacity [pixel]: base colour, its texture and the vertices' colours; lod: another rule
        than the scene's."""
        alpha = np.zeros(len(points.ids))
        for index in np.unique(self.triangles.material[points.ids]):
            chosen = self.triangles.material[points.ids] == index
            part = Points(**{name: field[chosen] for name, field in vars(points).items()})
            surface = Surface(self, self.scene.materials[index], part, lod)
            alpha[chosen] = surface.base_color[:, 3]
        return alpha

    def chain(self, image: int, *, srgb: bool) -> list[Float64]:
        """Mip chain of an image."""
        if (image, srgb) not in self._chains:
            pixels = self.scene.images[image].pixels
            self._chains[image, srgb] = mip_chain(pixels, srgb=srgb)
        return self._chains[image, srgb]


def on_a_line(corners: Float64) -> Bool:
    """Whether texture coordinates [pixel, corner, uv] have no area but for rounding."""
    sides = corners[:, 1:] - corners[:, :1]
    lost = UV_ROUNDING * np.abs(corners).max(axis=(1, 2)) * np.abs(sides).sum(axis=(1, 2))
    return np.asarray(np.abs(np.linalg.det(sides)) <= lost)


class Surface:
    """Points on one material."""

    def __init__(
        self, shading: Shading, material: Material, points: Points, lod: str | None = None
    ) -> None:
        self._lod = lod or shading.lod
        self._shading = shading
        self._material = material
        self._points = points

    def texture(self, role: str) -> Float64 | None:
        """Filtered texels [pixel, rgba] of a slot, in linear light, or None without a texture."""
        slot = getattr(self._material, role)
        if slot is None:
            return None
        at = Footprints(*self.texcoord(role), self._points.views)
        chain = self._shading.chain(slot.image, srgb=role in SRGB_ROLES)
        return filtered(chain, at, slot.wrap, self._lod)

    def texcoord(self, role: str) -> tuple[Float64, Float64, Float64]:
        """A slot's texture coordinate [pixel, uv] and its change over a column and a row.

        KHR_texture_transform: the slot's matrix applies to (u, v, 1).
        """
        slot = getattr(self._material, role)
        points = self._points
        corners = self._shading.triangles.texcoords[points.ids][:, :, slot.texcoord]
        matrix = np.eye(3) if slot.uv_transform is None else slot.uv_transform
        uv = np.einsum("nc,ncu->nu", points.weights, corners @ matrix[:2, :2].T + matrix[:2, 2])
        sides = (corners[:, 1:] - corners[:, :1]) @ matrix[:2, :2].T
        uv_dx, uv_dy = (
            np.einsum("nc,ncu->nu", weights[:, 1:], sides)
            for weights in (points.weights_dx, points.weights_dy)
        )
        return uv, uv_dx, uv_dy

    @cached_property
    def base_color(self) -> Float64:
        """Linear RGBA [pixel, 4]: factor, vertex colour and texture multiplied."""
        color = self._points.blend(self._shading.triangles.colors[self._points.ids])
        color = color * np.array(self._material.base_color)
        texels = self.texture("base_color_texture")
        return color if texels is None else np.asarray(color * texels)

    @cached_property
    def normal(self) -> Float64:
        """Unit normals [pixel, xyz] in the world, normal map included, toward the side seen."""
        corners = self._shading.triangles.normals_world[self._points.ids]
        normal = unit(self._points.blend(corners))
        normal = self._mapped(normal)
        return np.where(self._points.back[:, None], -normal, normal)

    def _mapped(self, normal: Float64) -> Float64:
        """Normals turned by the normal map (glTF 3.9.3): red along +u, green against +v.

        The direction of u on the surface comes from the gradients of position and texture
        coordinate, made square to the normal; the third direction is square to both, on the side
        against v. Where texture coordinates stand still or move along a line there are none.
        """
        slot, texels = self._material.normal_texture, self.texture("normal_texture")
        if slot is None or texels is None:
            return normal
        _, uv_dx, uv_dy = self.texcoord("normal_texture")
        turn = self._shading.world_from_display[:3, :3].T
        p_dx, p_dy = self._points.p_display_dx @ turn, self._points.p_display_dy @ turn
        # Solve dp = p_u·du + p_v·dv over the column step and the row step.
        determinant = uv_dx[:, 0] * uv_dy[:, 1] - uv_dx[:, 1] * uv_dy[:, 0]
        flip = np.sign(determinant)[:, None]
        along_u = (p_dx * uv_dy[:, 1:] - p_dy * uv_dx[:, 1:]) * flip
        along_v = (p_dy * uv_dx[:, :1] - p_dx * uv_dy[:, :1]) * flip
        tangent = unit(along_u - normal * _dot(normal, along_u)[:, None])
        side = -np.sign(_dot(np.cross(normal, tangent), along_v))
        bitangent = side[:, None] * np.cross(normal, tangent)
        map_normal = 2.0 * texels[:, :3] - 1.0
        map_normal[:, :2] *= slot.scale
        turned = unit(
            map_normal[:, :1] * tangent
            + map_normal[:, 1:2] * bitangent
            + map_normal[:, 2:] * normal
        )
        lengths = np.linalg.norm(uv_dx, axis=1) * np.linalg.norm(uv_dy, axis=1)
        corners = self._shading.triangles.texcoords[self._points.ids][:, :, slot.texcoord]
        without = on_a_line(corners) | (np.abs(determinant) <= LEAST_SINE * lengths)
        without |= (np.sum(tangent**2, axis=1) == 0.0) | (np.sum(bitangent**2, axis=1) == 0.0)
        return np.where(without[:, None], normal, turned)

    @cached_property
    def occlusion(self) -> Float64:
        """Share of the environment's light that arrives, [pixel]: the map's red by the strength."""
        slot, texels = self._material.occlusion_texture, self.texture("occlusion_texture")
        if slot is None or texels is None:
            return np.ones(len(self._points.ids))
        return 1.0 + slot.scale * (texels[:, 0] - 1.0)

    @cached_property
    def metallic_roughness(self) -> tuple[Float64, Float64]:
        """Metallic and roughness, [pixel] each: factors times the map's blue and green."""
        texels = self.texture("metallic_roughness_texture")
        ones = np.ones(len(self._points.ids))
        blue, green = (ones, ones) if texels is None else (texels[:, 2], texels[:, 1])
        return self._material.metallic * blue, self._material.roughness * green

    @cached_property
    def emitted(self) -> Float64:
        """Light that the surface sends out by itself, [pixel, rgb]."""
        texels = self.texture("emissive_texture")
        factor = np.tile(self._material.emissive, (len(self._points.ids), 1))
        return factor if texels is None else np.asarray(factor * texels[:, :3])

    def radiance(self, eye_world: Float64) -> Float64:
        """Scene-linear light [pixel, rgb] toward eyes [pixel, xyz]; the base colour when unlit."""
        base_color = self.base_color[:, :3]
        if self._material.unlit:
            return base_color
        metallic, roughness = self.metallic_roughness
        p_world = points_by(self._shading.world_from_display, self._points.p_display)
        toward_eye = unit(eye_world - p_world)
        # glTF B.3.5: dielectrics reflect 4 %, metals their base colour and scatter nothing.
        f0 = 0.04 + (base_color - 0.04) * metallic[:, None]
        albedo = base_color * (1.0 - metallic)[:, None]
        light = self.occlusion[:, None] * (
            albedo * self._shading.environment.diffuse(self.normal)
            + self._mirrored(f0, roughness, toward_eye)
        )
        for arrival in self._arrivals(p_world):
            light += self._lit(arrival, f0, albedo, roughness, toward_eye)
        return light + self.emitted

    def _arrivals(self, p_world: Float64) -> Sequence[Arrival]:
        """Light that comes from single directions."""
        lights = self._shading.scene.lights
        if lights:
            return [arriving(light, p_world) for light in lights]
        return self._shading.environment.key()

    def _mirrored(self, f0: Float64, roughness: Float64, toward_eye: Float64) -> Float64:
        """The environment seen in the surface: its blurred light by the environment BRDF."""
        normal = self.normal
        n_dot_v = _eye_cosine(normal, toward_eye)
        reflected = 2.0 * _dot(normal, toward_eye)[:, None] * normal - toward_eye
        scale, bias = environment_brdf(roughness, n_dot_v)
        light = self._shading.environment.radiance(reflected, roughness)
        # The polynomial dips below zero for black metals.
        return np.maximum(f0 * scale[:, None] + bias[:, None], 0.0) * light

    def _lit(
        self,
        arrival: Arrival,
        f0: Float64,
        albedo: Float64,
        roughness: Float64,
        toward_eye: Float64,
    ) -> Float64:
        """Light from one direction sent on, diffuse (albedo/π) and specular."""
        n_dot_l = np.maximum(0.0, _dot(self.normal, arrival.directions))
        halfway = unit(toward_eye + arrival.directions)
        specular = specular_brdf(
            f0,
            np.maximum(SMALLEST_ALPHA, roughness**2),
            n_dot_l=n_dot_l,
            n_dot_v=_eye_cosine(self.normal, toward_eye),
            n_dot_h=np.clip(_dot(self.normal, halfway), 0.0, 1.0),
            v_dot_h=np.clip(_dot(toward_eye, halfway), 0.0, 1.0),
        )
        lit: Float64 = arrival.irradiance * n_dot_l[:, None] * (albedo / np.pi + specular)
        return lit


def specular_brdf(
    f0: Float64,
    alpha: Float64,
    *,
    n_dot_l: Float64,
    n_dot_v: Float64,
    n_dot_h: Float64,
    v_dot_h: Float64,
) -> Float64:
    """Cook-Torrance [n, rgb] (glTF B.3.2): Trowbridge-Reitz, Smith's joint masking, Schlick."""
    distribution = alpha**2 / (np.pi * ((n_dot_h * alpha) ** 2 + 1.0 - n_dot_h**2) ** 2)
    seen = n_dot_l * np.sqrt(n_dot_v**2 * (1.0 - alpha**2) + alpha**2)
    lit = n_dot_v * np.sqrt(n_dot_l**2 * (1.0 - alpha**2) + alpha**2)
    masking = 0.5 / (seen + lit)
    fresnel = f0 + (1.0 - f0) * ((1.0 - v_dot_h) ** 5)[:, None]
    return fresnel * (distribution * masking)[:, None]


def environment_brdf(roughness: Float64, n_dot_v: Float64) -> tuple[Float64, Float64]:
    """Scale and bias of f0 under light from everywhere: the fit of Karis 2014 ("Physically based
    shading on mobile", after Lazarov 2013)."""
    r = [
        a * roughness + b
        for a, b in ((-1.0, 1.0), (-0.0275, 0.0425), (-0.572, 1.04), (0.022, -0.04))
    ]
    grazing = np.minimum(r[0] ** 2, 2.0 ** (-9.28 * n_dot_v)) * r[0] + r[1]
    return r[2] - 1.04 * grazing, r[3] + 1.04 * grazing


def _eye_cosine(normal: Float64, toward_eye: Float64) -> Float64:
    """|n·v|, off zero: an interpolated normal may turn away where the triangle does not."""
    return np.clip(np.abs(_dot(normal, toward_eye)), 1e-4, 1.0)


def _dot(a: Float64, b: Float64) -> Float64:
    return np.asarray(np.sum(a * b, axis=-1))


def opaque_at(shading: Shading, rig: Rig, grid: ViewGrid) -> Accepts:
    """The test that visibility asks: a triangle counts where its alpha reaches its cutoff."""

    def accepts(index: int, pixels: Pixels) -> Bool:
        cutoff = cutoff_of(shading.scene.materials[int(shading.triangles.material[index])])
        if cutoff == 0.0:
            return np.ones(len(pixels.row), bool)
        ids = np.full(len(pixels.row), index)
        points = points_at(shading.triangles, rig, grid, ids, pixels)
        return shading.coverage(points) >= cutoff

    return accepts


def cutoff_of(material: Material) -> float:
    """Least alpha at which a material counts. Of blended ones clear texels hide nothing behind."""
    match material.alpha_mode:
        case "mask":
            return material.alpha_cutoff
        case "blend":
            return LEAST_ALPHA
        case _:
            return 0.0

"""What the tests of the passes share: random scenes and displays, and passes run one by one."""

import dataclasses
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from hypothesis import Phase, settings
from numpy.typing import NDArray

from lfd_render.display import Camera, DisplayProfile, Rig, ViewGrid
from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import dtype
from lfd_render.gpu.lighting import EnvironmentMap
from lfd_render.gpu.memory import TextureArray
from lfd_render.gpu.scene_buffers import Batch, SceneBuffers
from lfd_render.passes.owned import OwnedSplat
from lfd_render.passes.placement import Placement
from lfd_render.passes.prefilter import Prefilter
from lfd_render.passes.sample import Sample
from lfd_render.passes.sampling import DEFAULT_SAMPLING, Points, Sampling
from lfd_render.passes.shade import Shade
from lfd_render.passes.splat import Splat, view_lanes
from lfd_render.passes.splat_cells import SplatCells
from lfd_render.passes.transform import Transform
from lfd_render.passes.view_buffers import choose_winners, make_view_buffers
from lfd_render.passes.view_target import Band, ViewTarget
from lfd_render.reference import Triangles, placed
from lfd_render.scene import Environment, Image, Instance, Material, Mesh, Pose, Scene, TextureSlot
from lfd_render.techniques.lfdpr import SOURCES

FULL = os.environ.get("LFD_FULL") == "1"
PAPER = "gavane-2024-tilted-4k"
DISPLAYS = (PAPER, "looking-glass-portrait-sample-a", "looking-glass-8_9-sample-a")


def count_of(reduced: int) -> int:
    """How many cases to try: ten times as many in a full run."""
    return 10 * reduced if FULL else reduced


def examples(reduced: int) -> settings:
    """So many examples of a property. Seeds of random scenes gain nothing from being shrunk."""
    return settings(max_examples=count_of(reduced), phases=(Phase.generate,))


# ---- displays ---------------------------------------------------------------------------------


def shifted(corners: NDArray[np.floating], *by: float) -> NDArray[np.float64]:
    """Corners [..., xyz] moved by x, y, z."""
    return np.asarray(corners + np.array(by))


def few_lenses(
    name: str, lens_count: float, resolution_px: tuple[int, int] | None = None
) -> DisplayProfile:
    """A shipped display with other numbers of lenses and pixels, so that its pictures are small."""
    data = json.loads(DisplayProfile.load(name).to_json())
    if resolution_px:
        data["panel"]["resolution_px"] = resolution_px
    data["lens"] = {
        "lens_count": lens_count,
        "drift": data["lens"]["drift"],
        "center": data["lens"].get("center", 0.0),
    }
    return DisplayProfile.from_json(json.dumps(data))


def random_grid(rng: np.random.Generator, name: str) -> tuple[DisplayProfile, ViewGrid]:
    """A display and a grid of its views: upright, or along few lenses."""
    if rng.random() < 0.5:
        profile = DisplayProfile.load(name)
        columns, rows = rng.integers(1, 70), rng.integers(1, 50)
        return profile, ViewGrid.upright(profile, int(columns), int(rows))
    profile = few_lenses(name, rng.uniform(3.0, 60.0))
    return profile, ViewGrid.lens(profile, int(rng.integers(1, 50)))


def exact_views() -> tuple[Rig, ViewGrid]:
    """Eyes, window and pixels at powers of two: float32 computes corners and edges exactly."""
    grid = ViewGrid(
        rows=32,
        columns=64,
        column_mm=4.0,
        row_offset=np.full(32, 32.0),
        row_base=np.zeros(32, np.int32),
        kind="upright",
        panel_mm=(256.0, 128.0),
    )
    return Rig(np.array([-64.0, 0.0, 128.0]), 512.0, (256.0, 128.0), 32.0), grid


# ---- scenes -----------------------------------------------------------------------------------


def mesh_of(
    corners: NDArray[np.floating],
    material: int = 0,
    *,
    normals: NDArray[np.floating] | None = None,
    texcoords: NDArray[np.floating] | None = None,
    colors: NDArray[np.floating] | None = None,
) -> Mesh:
    """A mesh of loose triangles. corners: [triangle, corner, xyz]; the rest per corner likewise."""
    count = 3 * len(corners)

    def flat(values: NDArray[np.floating] | None, default: NDArray[np.float32]) -> NDArray:
        array = default if values is None else values
        return np.broadcast_to(array, (len(corners), 3, *default.shape)).reshape(
            count, *default.shape
        ).astype(np.float32)  # fmt: skip

    triangles = np.arange(count, dtype=np.uint32).reshape(-1, 3)
    return Mesh(
        f"mesh {material}",
        flat(corners, np.zeros(3, np.float32)),
        flat(normals, np.array([0, 0, 1], np.float32)),
        flat(texcoords, np.zeros((2, 2), np.float32)),
        flat(colors, np.ones(4, np.float32)),
        triangles,
        material,
    )


def scene_of(*meshes: Mesh, materials: tuple[Material, ...] = (Material("plain"),)) -> Scene:
    """A scene in which each mesh stands once, in world space."""
    instances = tuple(Instance(mesh.name, i, np.eye(4)) for i, mesh in enumerate(meshes))
    return Scene("test", meshes, instances, materials)


def soup(rng: np.random.Generator, count: int, profile: DisplayProfile) -> NDArray[np.float64]:
    """Triangles [triangle, corner, xyz] in display space, of every kind that is hard to draw.

    Sizes run from 0.01 of a small pixel to 100 windows; there are slivers, triangles that cross the
    near plane, that lie behind the viewer, that stand edge-on, and that share edges or planes.
    """
    width, height = profile.size_mm
    distance = profile.distance_mm
    z = rng.uniform(-0.6 * distance, 0.9 * distance, (count, 1))
    k = distance / (distance - z)
    centre = np.concatenate([rng.uniform(-0.7, 0.7, (count, 2)) * (width, height) / k, z], axis=1)
    size = rng.uniform(0.01, 0.3, (count, 1)) * width / k
    tiny = rng.random((count, 1)) < 0.3
    size = np.where(tiny, 10.0 ** rng.uniform(-2.5, 0.5, (count, 1)), size)
    huge = rng.random((count, 1)) < 0.04
    size = np.where(huge, width * 10.0 ** rng.uniform(0.0, 2.0, (count, 1)), size)
    corners = centre[:, None] + size[:, None] * rng.normal(size=(count, 3, 3))
    kind = rng.integers(0, 10, count)
    sliver = kind == 0
    corners[sliver, 1] = corners[sliver, 0] + 1e-3 * (corners[sliver, 2] - corners[sliver, 0])
    corners[sliver, 1] += 0.02 * rng.normal(size=(sliver.sum(), 3))
    near = kind == 1
    corners[near, 0, 2] = distance * rng.uniform(0.94, 1.1, near.sum())
    behind = kind == 2
    corners[behind, :, 2] += 1.2 * distance
    edge_on = kind == 3  # in a plane through an eye's line
    corners[edge_on, 2, 1] = corners[edge_on, 0, 1]
    shared = np.flatnonzero(kind >= 8)[1:]  # an edge of the triangle before, the other way round
    corners[shared, :2] = corners[shared - 1][:, [2, 1]]
    facing = rng.random(count) < 0.4
    corners[facing, :, 2] = centre[facing, None, 2]  # parallel to the panel
    return corners


def random_scene(rng: np.random.Generator, profile: DisplayProfile, count: int) -> Scene:
    """Instances of triangle soups, mirrored and stretched ones too, of materials of each kind."""
    picture = rng.integers(0, 256, (8, 16, 4)).astype(np.uint8)
    clear = rng.integers(-255, 256, (4, 4, 4)).clip(0).astype(np.uint8)  # half of its texels
    turn = np.array([[0.6, -0.8, 0.1], [0.8, 0.6, 0.2], [0.0, 0.0, 1.0]])
    slot = TextureSlot(0, wrap=("mirror", "clamp"), uv_transform=turn)
    materials = (
        Material("plain", (0.8, 0.5, 0.3, 1.0), metallic=0.2, roughness=0.6),
        Material("both", metallic=0.0, roughness=0.4, double_sided=True, base_color_texture=slot),
        Material("mask", alpha_mode="mask", alpha_cutoff=0.4, base_color_texture=TextureSlot(0, 1)),
        Material(
            "glass", (0.3, 0.9, 0.4, 0.5), alpha_mode="blend", double_sided=True, unlit=True,
            base_color_texture=TextureSlot(1),
        ),
    )  # fmt: skip
    meshes, instances = [], []
    for index in range(len(materials)):
        corners = soup(rng, count, profile)
        normals = rng.normal(size=(count, 3, 3))
        meshes.append(
            mesh_of(
                corners,
                index,
                normals=normals / np.linalg.norm(normals, axis=-1, keepdims=True),
                texcoords=rng.uniform(-1, 2, (count, 3, 2, 2)),
                colors=rng.uniform(0.5, 1.0, (count, 3, 4)),
            )
        )
        instances.append(Instance(f"placed {index}", index, placement(rng)))
    instances.append(Instance("again", 0, placement(rng, mirrored=True)))
    instances.append(Instance("mirrored mask", 2, placement(rng, mirrored=True)))
    images = (Image("noise", picture), Image("clear", clear))
    return Scene("random", tuple(meshes), tuple(instances), materials, images)


def placement(rng: np.random.Generator, *, mirrored: bool = False) -> NDArray[np.float64]:
    """world_from_local [4, 4]: turned by a little, stretched, moved."""
    angle = rng.uniform(-0.5, 0.5)
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    matrix[:3, :3] *= rng.uniform(0.7, 1.4, 3) * ([-1, 1, 1] if mirrored else [1, 1, 1])
    matrix[:3, 3] = rng.uniform(-10.0, 10.0, 3)
    return matrix


def millimetre_camera(panel_mm: tuple[float, float], **options: float) -> Camera:
    """The camera for which world and display space are the same, but for its options."""
    return Camera((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), panel_mm[1], **options)


def random_camera(rng: np.random.Generator, panel_mm: tuple[float, float]) -> NDArray[np.float64]:
    """display_from_world [4, 4] of a camera near that one."""
    camera = millimetre_camera(panel_mm, depth_scale=rng.uniform(0.8, 1.0))
    return camera.turned(rng.uniform(-0.3, 0.3)).display_from_world(panel_mm)


# ---- passes -----------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True, eq=False)
class Winners:
    """What the splatter found, [row, view, column], ids and float32 depths of both stages."""

    solid: NDArray[np.uint32]
    solid_depths: NDArray[np.float32]
    blended: NDArray[np.uint32]
    blended_depths: NDArray[np.float32]


class Passes:
    """A scene placed before a target, with room for all its points; passes run when asked."""

    def __init__(
        self,
        device: Device,
        scene: Scene,
        rig: Rig,
        grid: ViewGrid,
        display_from_world: NDArray[np.float64] | None = None,
        *,
        general: bool = False,
        winners: str = "auto",
        sampling: Sampling = DEFAULT_SAMPLING,
        background: tuple[float, float, float] = (0.0, 0.0, 0.0),
        pose: Pose | None = None,
        seed: int = 0,
        environment: str | Environment = "studio",
        turn_rad: float = 0.0,
        intensity: float = 1.0,
        lod: str = "area",
    ) -> None:
        self.scene, self.rig, self.grid, self.pose = scene, rig, grid, pose
        self.display_from_world = np.eye(4) if display_from_world is None else display_from_world
        self.placement = Placement(self.display_from_world, background)
        self.buffers = SceneBuffers(device, scene)
        self.map = (
            prefiltered(device, environment) if isinstance(environment, Environment) else None
        )
        self.buffers.lighting.use(self.map or environment, turn_rad=turn_rad, intensity=intensity)
        self.target = ViewTarget(device, rig, grid, self.buffers.batches, seed)
        self.transform = Transform(device)
        cells = sampling.lattice == "paper"
        common = (device, self.buffers, self.target)
        chosen = choose_winners(device, winners, ownable=not (general or cells))
        self.sample = (
            SOURCES[sampling.source](*common, sampling)
            if cells
            else Sample(
                device,
                self.buffers,
                view_lanes(rig.views),
                sampling=sampling,
                whole_rows=general,
                binned_rows=self.target.band_rows if chosen == "owned" else 0,
            )
        )
        self.int64 = chosen == "int64"
        if cells:
            self.splat = SplatCells(*common, sampling, int64=self.int64, lod=lod)
        elif chosen == "owned":
            self.splat = OwnedSplat(*common, lod=lod, sampling=sampling)
        else:
            self.splat = Splat(
                *common, general=general, int64=self.int64, lod=lod, sampling=sampling
            )
        self.views = make_view_buffers(device, self.target, chosen)
        self.shade = Shade(*common, self.views.word_stride, lod=lod, sampling=sampling)
        self.points = [self.sample.allocate(batch) for batch in self.buffers.batches]
        self.buffers.pose(pose)
        self.buffers.place(self.display_from_world)
        for batch in self.buffers.batches:
            self.transform(self.buffers, batch)
        self._make_room()

    def _make_room(self) -> None:
        for batch, points in self.batches:
            for band in self.target.bands:
                self.sample(batch, points, band)
            self.sample.fit(points)
            while isinstance(self.splat, SplatCells):
                self._fill(batch, points)
                if not self.sample.fit(points):
                    break
            if isinstance(self.splat, OwnedSplat):
                self._fill(batch, points)
                self.sample.fit(points)

    def _fill(self, batch: Batch, points: Points) -> None:
        for band in self.target.bands:
            self.sample(batch, points, band)
            for window in range(points.windows):
                self.sample.fill(batch, points, band, window)

    @property
    def batches(self) -> list[tuple]:
        """Batches with their points, in the order of ids."""
        return list(zip(self.buffers.batches, self.points, strict=True))

    def triangles(self) -> Triangles:
        """The reference's triangles, at the positions that the device computed."""
        p_display = [
            batch.display_vertices.read(np.float32)
            .reshape(-1, 4)[batch.corners.read(np.uint32).reshape(-1, 4)[:, :3], :3]
            .astype(np.float64)
            for batch in self.buffers.batches
        ]
        expected = placed(self.scene, self.display_from_world, self.pose)
        return dataclasses.replace(expected, p_display=np.concatenate(p_display))

    def rows(self) -> tuple[NDArray[np.void], NDArray[np.float32]]:
        """All rows of points, PointRow [row] with `triangle` as a global id, and lengths of their
        points, [row]."""
        found, lengths = [], []
        for band in self.target.bands:
            for batch, points in self.batches:
                self.sample(batch, points, band)
                length = points.spans.read(dtype("Span"))["point_columns"]
                for window in range(points.windows):
                    self.sample.fill(batch, points, band, window)
                    count = int(points.work.read(dtype("Work"))[window]["items"])
                    rows = points.rows.read(dtype("PointRow"))[:count].copy()
                    lengths.append(length[rows["triangle"]])
                    rows["triangle"] += np.uint32(batch.triangle_base)
                    found.append(rows)
        return np.concatenate(found), np.concatenate(lengths)

    def count_points(self) -> int:
        """Points of all batches and bands, counted by the device."""
        total = 0
        for band in self.target.bands:
            for batch, points in self.batches:
                self.sample(batch, points, band)
                self.sample.fill(batch, points, band, 0)
                total += self.sample.count(batch, points, band)
        return total

    def winners(self) -> Winners:
        """Splat all bands."""
        return Winners(*(np.concatenate(parts) for parts in zip(*self._bands(), strict=True)))

    def images(self) -> NDArray[np.float64]:
        """Splat and shade all bands: [view, row, column, rgb]."""
        found = []
        for band, _ in zip(self.target.bands, self._bands(shaded=True), strict=True):
            rgba = self.target.images.read(np.float16, gl.HALF_FLOAT)
            found.append(rgba[:, : band.rows, :, :3].astype(np.float64))
        return np.concatenate(found, axis=1)

    def _bands(self, *, shaded: bool = False) -> Iterator[tuple[NDArray, ...]]:
        for band in self.target.bands:
            for batch, points in self.batches:
                self.sample(batch, points, band)
            self.views.clear()
            solid = self._layer(band, shaded, blended=False)
            self.views.clear_words()
            yield *solid, *self._layer(band, shaded, blended=True)

    def _layer(self, band: Band, shaded: bool, *, blended: bool) -> tuple[NDArray, NDArray]:
        pairs = [pair for pair in self.batches if (pair[0].alpha_mode == "blend") == blended]
        for step in self.splat.steps:
            for batch, points in pairs:
                for window in range(points.windows):
                    self.sample.fill(batch, points, band, window)
                    self.splat(step, batch, points, window=window, band=band, views=self.views)
        if shaded:
            shade = self.shade.blend if blended else self.shade.opaque
            shade(pairs, band, self.views, self.placement)
        return self._read(band)

    def _read(self, band: Band) -> tuple[NDArray[np.uint32], NDArray[np.float32]]:
        """Words and depths of a band, [row, view, column]."""
        shape = (band.rows, self.rig.views, self.grid.columns)
        count = int(np.prod(shape))
        if self.views.word_stride == 2:
            pairs = self.views.words.read(np.uint32, 2 * count).reshape(*shape, 2)
            words, bits = pairs[..., 0], pairs[..., 1]  # depth above id
        else:
            words = self.views.words.read(np.uint32, count).reshape(shape)
            bits = self.views.depths.read(np.uint32, count).reshape(shape)
        # Nothing is infinitely far, however a layout says it.
        return words, np.minimum(bits, np.uint32(0x7F800000)).view(np.float32)

    def release(self) -> None:
        """Free everything."""
        for owner in (
            *self.points, self.transform, self.sample, self.splat, self.shade, self.views,
            self.target, self.buffers,
        ):  # fmt: skip
            owner.release()
        if self.map:
            self.map.release()


def prefiltered(device: Device, environment: Environment) -> EnvironmentMap:
    """An environment's map, whose release is the caller's."""
    prefilter = Prefilter(device)
    found = prefilter(environment)
    prefilter.release()
    return found


@contextmanager
def passes(device: Device, scene: Scene, rig: Rig, grid: ViewGrid, *args, **options):
    """Passes that are released at the end, and leave nothing on the device."""
    before = device.ledger.total
    opened = Passes(device, scene, rig, grid, *args, **options)
    try:
        yield opened
    finally:
        opened.release()
    assert device.ledger.total == before


def fill(device: Device, texture: TextureArray, layers: NDArray[np.floating]) -> None:
    """Set a half-float texture array from [layer, y, x, rgb]; alpha 1."""
    alpha = np.ones((*layers.shape[:3], 1))
    data = np.ascontiguousarray(np.concatenate([layers, alpha], axis=-1), np.float32)
    count, height, width = layers.shape[:3]
    for layer in range(count):
        device.raw.glTextureSubImage3D(
            texture.name, 0, 0, 0, layer, width, height, 1, gl.RGBA, gl.FLOAT,
            data[layer].ctypes.data,
        )  # fmt: skip

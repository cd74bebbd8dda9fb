"""What a scene is: frozen numpy data in world space, no GPU, no file format.

Meshes are shared by instances; nothing is duplicated per instance. Every constructor checks
shapes, dtypes, finite values and index bounds, and raises SceneError naming mesh and field.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NotRequired, TypedDict

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import SceneError
from lfd_render.scene.limits import MOST_LIGHTS, LoadLimits

Wrap = Literal["repeat", "clamp", "mirror"]
AlphaMode = Literal["opaque", "mask", "blend"]
WRAPS: tuple[Wrap, ...] = ("repeat", "clamp", "mirror")
ALPHA_MODES: tuple[AlphaMode, ...] = ("opaque", "mask", "blend")
LightKind = Literal["directional", "point", "spot"]
LIGHT_KINDS: tuple[LightKind, ...] = ("directional", "point", "spot")

_BOUNDS_CHUNK = 1 << 18  # vertices transformed at once: 6 MB of float64


class WindowCamera(TypedDict):
    """Where the display's window stands in the world, with the keys of a camera file."""

    target: list[float]
    eye_direction: list[float]
    up: list[float]
    window_height: float
    depth_scale: NotRequired[float]


@dataclass(frozen=True, eq=False)
class Image:
    """A decoded picture: `pixels` is [y, x, 4] uint8, rows top to bottom."""

    name: str
    pixels: NDArray[np.uint8]

    def __post_init__(self) -> None:
        """Check the array and make it read-only."""
        _freeze(self, f"image '{self.name}'", "pixels", np.uint8, (None, None, 4))
        if self.pixels.size == 0:
            raise SceneError(f"image '{self.name}': pixels: no texels; give at least 1 × 1")


@dataclass(frozen=True, eq=False)
class TextureSlot:
    """How a material reads one image.

    `texcoord` is the coordinate set (0 or 1), `wrap` the pair for s and t, `scale` the normal
    scale or occlusion strength, `uv_transform` a [3, 3] float64 matrix applied to (u, v, 1)
    (KHR_texture_transform) or None. Texture v runs down the picture, as in glTF.
    """

    image: int
    texcoord: int = 0
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    scale: float = 1.0
    uv_transform: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        """Check ranges."""
        if self.image < 0:
            raise SceneError(f"texture: image: {self.image}; give an index from 0")
        if self.texcoord not in (0, 1):
            raise SceneError(f"texture: texcoord: {self.texcoord}; coordinate sets are 0 and 1")
        if len(self.wrap) != 2 or any(w not in WRAPS for w in self.wrap):
            raise SceneError(f"texture: wrap: {self.wrap}; give two of {', '.join(WRAPS)}")
        if not np.isfinite(self.scale):
            raise SceneError(f"texture: scale: {self.scale}; give a finite number")
        if self.uv_transform is not None:
            _freeze(self, "texture", "uv_transform", np.float64, (3, 3))


@dataclass(frozen=True, eq=False)
class Material:
    """A glTF metallic-roughness material; factors are linear, textures multiply them."""

    name: str
    base_color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    metallic: float = 1.0
    roughness: float = 1.0
    emissive: tuple[float, float, float] = (0.0, 0.0, 0.0)
    alpha_mode: AlphaMode = "opaque"
    alpha_cutoff: float = 0.5
    double_sided: bool = False
    unlit: bool = False
    base_color_texture: TextureSlot | None = None
    metallic_roughness_texture: TextureSlot | None = None
    normal_texture: TextureSlot | None = None
    occlusion_texture: TextureSlot | None = None
    emissive_texture: TextureSlot | None = None

    def __post_init__(self) -> None:
        """Check factors: base colour, metallic and roughness lie in 0…1, emissive is ≥ 0."""
        self._check_factor("base_color", self.base_color, 4, 1.0)
        self._check_factor("metallic", (self.metallic,), 1, 1.0)
        self._check_factor("roughness", (self.roughness,), 1, 1.0)
        self._check_factor("emissive", self.emissive, 3, np.inf)
        self._check_factor("alpha_cutoff", (self.alpha_cutoff,), 1, np.inf)
        if self.alpha_mode not in ALPHA_MODES:
            raise SceneError(
                f"material '{self.name}': alpha_mode: {self.alpha_mode!r}; "
                f"give one of {', '.join(ALPHA_MODES)}"
            )

    def _check_factor(self, field: str, values: Sequence[float], count: int, high: float) -> None:
        good = len(values) == count and all(0.0 <= v <= high and np.isfinite(v) for v in values)
        if not good:
            limit = "finite and ≥ 0" if high == np.inf else f"from 0 to {high:g}"
            raise SceneError(
                f"material '{self.name}': {field}: {tuple(values)}; give {count} numbers {limit}"
            )

    def texture_slots(self) -> dict[str, TextureSlot]:
        """The slots that are in use, by field name."""
        return {name: value for name, value in vars(self).items() if isinstance(value, TextureSlot)}


@dataclass(frozen=True, eq=False)
class Mesh:
    """Indexed triangles of one material, counter-clockwise seen from the front.

    positions f32[n,3], normals f32[n,3] of unit length, texcoords f32[n,2,2] as
    [vertex, set, uv], colors f32[n,4] linear, triangles u32[m,3].
    """

    name: str
    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    texcoords: NDArray[np.float32]
    colors: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    material: int

    def __post_init__(self) -> None:
        """Check arrays against each other and make them read-only."""
        label = f"mesh '{self.name}'"
        count = len(self.positions)
        _freeze(self, label, "positions", np.float32, (None, 3))
        _freeze(self, label, "normals", np.float32, (count, 3))
        _freeze(self, label, "texcoords", np.float32, (count, 2, 2))
        _freeze(self, label, "colors", np.float32, (count, 4))
        _freeze(self, label, "triangles", np.uint32, (None, 3))
        if self.material < 0:
            raise SceneError(f"{label}: material: {self.material}; give an index from 0")
        if self.triangles.size and int(self.triangles.max()) >= count:
            raise SceneError(
                f"{label}: triangles: index {int(self.triangles.max())} out of range; "
                f"the mesh has {count} vertices"
            )


@dataclass(frozen=True, eq=False)
class Instance:
    """A mesh placed in the world; a negative determinant mirrors it and turns its winding."""

    name: str
    mesh: int
    world_from_local: NDArray[np.float64]

    def __post_init__(self) -> None:
        """Check the matrix: finite, affine."""
        _check_affine(self, f"instance '{self.name}'", "world_from_local")


@dataclass(frozen=True, eq=False)
class SceneCamera:
    """A perspective camera of the file, looking along its own −z."""

    name: str
    world_from_camera: NDArray[np.float64]
    yfov_rad: float

    def __post_init__(self) -> None:
        """Check the matrix and the field of view."""
        label = f"camera '{self.name}'"
        _check_affine(self, label, "world_from_camera")
        if not 0.0 < self.yfov_rad < np.pi:
            raise SceneError(f"{label}: yfov_rad: {self.yfov_rad}; give an angle from 0 to π")


@dataclass(frozen=True, eq=False)
class Light:
    """A light without size (KHR_lights_punctual), which shines along its own −z.

    `intensity` is in lux (directional) or candela (point, spot), `color` linear; `range` is in
    world units, None without end. Spots fade from `inner_cone_rad` to `outer_cone_rad`, measured
    from their axis. Of the matrix only where it stands and turns to counts, not its scale.
    """

    name: str
    kind: LightKind
    world_from_light: NDArray[np.float64]
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    intensity: float = 1.0
    range: float | None = None
    inner_cone_rad: float = 0.0
    outer_cone_rad: float = np.pi / 4

    def __post_init__(self) -> None:
        """Check the matrix and ranges."""
        label = f"light '{self.name}'"
        if self.kind not in LIGHT_KINDS:
            raise SceneError(f"{label}: kind: {self.kind!r}; give one of {', '.join(LIGHT_KINDS)}")
        _check_affine(self, label, "world_from_light")
        if self.kind != "point" and not np.any(self.world_from_light[:3, 2]):
            raise SceneError(f"{label}: world_from_light: its −z has no length; scale it up")
        powers = (*self.color, self.intensity)
        if len(self.color) != 3 or not all(0.0 <= p < np.inf for p in powers):
            raise SceneError(
                f"{label}: color {self.color}, intensity {self.intensity}; "
                "give finite numbers from 0"
            )
        if self.range is not None and not 0.0 < self.range < np.inf:
            raise SceneError(f"{label}: range: {self.range}; give a number above 0, or None")
        if not 0.0 <= self.inner_cone_rad < self.outer_cone_rad <= np.pi / 2:
            raise SceneError(
                f"{label}: cones {self.inner_cone_rad}, {self.outer_cone_rad}; give angles "
                "0 ≤ inner < outer ≤ π/2"
            )


@dataclass(frozen=True, eq=False)
class Scene:
    """Meshes, where they stand, what they are made of, and lights of their own, if any."""

    name: str
    meshes: tuple[Mesh, ...]
    instances: tuple[Instance, ...]
    materials: tuple[Material, ...]
    images: tuple[Image, ...] = ()
    cameras: tuple[SceneCamera, ...] = ()
    default_camera: WindowCamera | None = None
    warnings: tuple[str, ...] = ()
    lights: tuple[Light, ...] = ()

    def __post_init__(self) -> None:
        """Check every index and that something can be drawn."""
        for mesh in self.meshes:
            if mesh.material >= len(self.materials):
                raise SceneError(
                    f"mesh '{mesh.name}': material: {mesh.material}; "
                    f"the scene has {len(self.materials)}"
                )
        for instance in self.instances:
            if not 0 <= instance.mesh < len(self.meshes):
                raise SceneError(
                    f"instance '{instance.name}': mesh: {instance.mesh}; "
                    f"the scene has {len(self.meshes)}"
                )
        for material in self.materials:
            for field, slot in material.texture_slots().items():
                if slot.image >= len(self.images):
                    raise SceneError(
                        f"material '{material.name}': {field}: image {slot.image}; "
                        f"the scene has {len(self.images)}"
                    )
        if len(self.lights) > MOST_LIGHTS:
            raise SceneError(f"lights: {len(self.lights)}; give at most {MOST_LIGHTS}")
        if self.triangle_count == 0:
            raise SceneError("meshes: 0 triangles; give a scene with at least one triangle")

    @property
    def triangle_count(self) -> int:
        """Triangles drawn: each mesh counts once an instance."""
        return sum(len(self.meshes[i.mesh].triangles) for i in self.instances)

    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Smallest and largest world coordinates, each [3] float64, over all instances."""
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for instance in self.instances:
            positions = self.meshes[instance.mesh].positions
            world_from_local = instance.world_from_local
            for start in range(0, len(positions), _BOUNDS_CHUNK):
                chunk = positions[start : start + _BOUNDS_CHUNK].astype(np.float64)
                p_world = chunk @ world_from_local[:3, :3].T + world_from_local[:3, 3]
                low = np.minimum(low, p_world.min(axis=0))
                high = np.maximum(high, p_world.max(axis=0))
        return low, high

    @staticmethod
    def load(source: str | Path, limits: LoadLimits | None = None) -> Scene:
        """Read a `.gltf`, `.glb` or `.obj` file, or make a `builtin:NAME?triangles=N`.

        Raises SceneError, or ResourceError beyond the limits, in one line that names the
        source, the field, the value and the remedy.
        """
        from lfd_render.scene.loading import load_scene  # noqa: PLC0415 (the loaders import this module)

        return load_scene(source, limits or LoadLimits())


def _freeze(
    owner: Any, label: str, field: str, dtype: type[np.generic], shape: tuple[int | None, ...]
) -> None:
    """Check one array field of a frozen dataclass and put a read-only view in its place."""
    array = getattr(owner, field)
    wanted = "[" + ", ".join("n" if s is None else str(s) for s in shape) + f"] {dtype.__name__}"
    if not isinstance(array, np.ndarray):
        raise SceneError(f"{label}: {field}: {type(array).__name__}; give a numpy array {wanted}")
    fits = len(array.shape) == len(shape) and all(
        want in (None, got) for want, got in zip(shape, array.shape, strict=True)
    )
    if not fits or array.dtype != dtype:
        raise SceneError(f"{label}: {field}: {list(array.shape)} {array.dtype}; give {wanted}")
    # The extremes carry any NaN or infinity and, unlike isfinite, need no array of their own.
    extremes = (array.min(), array.max()) if array.size else ()
    if issubclass(dtype, np.floating) and not np.isfinite(extremes).all():
        row = int(np.argmin(np.isfinite(array.reshape(len(array), -1)).all(axis=1)))
        raise SceneError(f"{label}: {field}[{row}]: {array[row].tolist()}; give finite numbers")
    view = array.view()
    view.setflags(write=False)
    object.__setattr__(owner, field, view)


def _check_affine(owner: Any, label: str, field: str) -> None:
    _freeze(owner, label, field, np.float64, (4, 4))
    matrix: NDArray[np.float64] = getattr(owner, field)
    if not np.array_equal(matrix[3], (0.0, 0.0, 0.0, 1.0)):
        raise SceneError(f"{label}: {field}: last row {matrix[3].tolist()}; give 0 0 0 1")

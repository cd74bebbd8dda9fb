"""What a scene is: frozen numpy data, no GPU, no file format.

Meshes are shared by instances; nothing is duplicated per instance. What moves hangs on nodes; a
`Pose` says where they stand, by default at rest. Every constructor checks shapes, dtypes, finite
values and index bounds, and raises SceneError naming mesh and field.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NotRequired, TypedDict

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import SceneError
from lfd_render.scene.checks import check_affine, freeze
from lfd_render.scene.deform import Influences, Morph, Skin
from lfd_render.scene.limits import MOST_LIGHTS, LoadLimits
from lfd_render.scene.nodes import Nodes

if TYPE_CHECKING:
    from lfd_render.scene.pose import Pose

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
        freeze(self, f"image '{self.name}'", "pixels", np.uint8, (None, None, 4))
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
            freeze(self, "texture", "uv_transform", np.float64, (3, 3))


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
    [vertex, set, uv], colors f32[n,4] linear, triangles u32[m,3]. With morph targets or joint
    influences these positions and normals are those before either. flat: normals are the
    triangles' own, and triangle t has vertices 3t, 3t + 1, 3t + 2.
    """

    name: str
    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    texcoords: NDArray[np.float32]
    colors: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    material: int
    morph: Morph | None = None
    influences: Influences | None = None
    flat: bool = False

    def __post_init__(self) -> None:
        """Check arrays against each other and make them read-only."""
        label = f"mesh '{self.name}'"
        count = len(self.positions)
        freeze(self, label, "positions", np.float32, (None, 3))
        freeze(self, label, "normals", np.float32, (count, 3))
        freeze(self, label, "texcoords", np.float32, (count, 2, 2))
        freeze(self, label, "colors", np.float32, (count, 4))
        freeze(self, label, "triangles", np.uint32, (None, 3))
        if self.material < 0:
            raise SceneError(f"{label}: material: {self.material}; give an index from 0")
        if self.triangles.size and int(self.triangles.max()) >= count:
            raise SceneError(
                f"{label}: triangles: index {int(self.triangles.max())} out of range; "
                f"the mesh has {count} vertices"
            )
        if self.morph is not None and self.morph.positions.shape[1] != count:
            raise SceneError(
                f"{label}: morph: {self.morph.positions.shape[1]} displacements a target; "
                f"the mesh has {count} vertices"
            )
        if self.influences is not None and len(self.influences.joints) != count:
            raise SceneError(
                f"{label}: influences: of {len(self.influences.joints)} vertices; "
                f"the mesh has {count}"
            )
        in_order = np.arange(count, dtype=np.uint32)
        if self.flat and not np.array_equal(self.triangles.ravel(), in_order):
            raise SceneError(f"{label}: flat: triangles share vertices; give each its own")

    @property
    def target_count(self) -> int:
        """Morph targets of the mesh."""
        return 0 if self.morph is None else len(self.morph.positions)


@dataclass(frozen=True, eq=False)
class Instance:
    """A mesh placed in the world; a negative determinant mirrors it and turns its winding.

    node: the node that places it, at rest by this very matrix; None: it stands still. skin: one of
    the scene's, whose joints take the mesh from its bind pose into the world; its matrix and
    node's transform then count for nothing. weights: of the morph targets at rest, one each.
    """

    name: str
    mesh: int
    world_from_local: NDArray[np.float64]
    node: int | None = None
    skin: int | None = None
    weights: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Check the matrix, finite and affine, and the weights."""
        check_affine(self, f"instance '{self.name}'", "world_from_local")
        if not np.isfinite(self.weights).all():
            raise SceneError(
                f"instance '{self.name}': weights: {self.weights}; give finite numbers"
            )


@dataclass(frozen=True, eq=False)
class SceneCamera:
    """A perspective camera of the file, looking along its own −z. node: what carries it."""

    name: str
    world_from_camera: NDArray[np.float64]
    yfov_rad: float
    node: int | None = None

    def __post_init__(self) -> None:
        """Check the matrix and the field of view."""
        label = f"camera '{self.name}'"
        check_affine(self, label, "world_from_camera")
        if not 0.0 < self.yfov_rad < np.pi:
            raise SceneError(f"{label}: yfov_rad: {self.yfov_rad}; give an angle from 0 to π")


@dataclass(frozen=True, eq=False)
class Light:
    """A light without size (KHR_lights_punctual), which shines along its own −z.

    `intensity` is in lux (directional) or candela (point, spot), `color` linear; `range` is in
    world units, None without end. Spots fade from `inner_cone_rad` to `outer_cone_rad`, measured
    from their axis. Of the matrix only where it stands and turns to counts, not its scale.
    `node` carries it, at rest by this matrix.
    """

    name: str
    kind: LightKind
    world_from_light: NDArray[np.float64]
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    intensity: float = 1.0
    range: float | None = None
    inner_cone_rad: float = 0.0
    outer_cone_rad: float = np.pi / 4
    node: int | None = None

    def __post_init__(self) -> None:
        """Check the matrix and ranges."""
        label = f"light '{self.name}'"
        if self.kind not in LIGHT_KINDS:
            raise SceneError(f"{label}: kind: {self.kind!r}; give one of {', '.join(LIGHT_KINDS)}")
        check_affine(self, label, "world_from_light")
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
    """Meshes, where they stand, what they are made of, lights of their own, if any, and the nodes
    and skins that move them, in files that have some."""

    name: str
    meshes: tuple[Mesh, ...]
    instances: tuple[Instance, ...]
    materials: tuple[Material, ...]
    images: tuple[Image, ...] = ()
    cameras: tuple[SceneCamera, ...] = ()
    default_camera: WindowCamera | None = None
    warnings: tuple[str, ...] = ()
    lights: tuple[Light, ...] = ()
    nodes: Nodes = field(default_factory=Nodes)
    skins: tuple[Skin, ...] = ()

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
            for role, slot in material.texture_slots().items():
                if slot.image >= len(self.images):
                    raise SceneError(
                        f"material '{material.name}': {role}: image {slot.image}; "
                        f"the scene has {len(self.images)}"
                    )
        if len(self.lights) > MOST_LIGHTS:
            raise SceneError(f"lights: {len(self.lights)}; give at most {MOST_LIGHTS}")
        if self.triangle_count == 0:
            raise SceneError("meshes: 0 triangles; give a scene with at least one triangle")
        self._check_nodes()

    def _check_nodes(self) -> None:
        """Check what hangs on nodes, and skins."""
        for skin in self.skins:
            if int(skin.joints.min()) < 0 or int(skin.joints.max()) >= len(self.nodes):
                raise SceneError(
                    f"skin '{skin.name}': joints {int(skin.joints.min())} to "
                    f"{int(skin.joints.max())}; the scene has {len(self.nodes)} nodes"
                )
        for kind, things in (
            ("instance", self.instances), ("light", self.lights), ("camera", self.cameras),
        ):  # fmt: skip
            for thing in things:
                if thing.node is not None and not 0 <= thing.node < len(self.nodes):
                    raise SceneError(
                        f"{kind} '{thing.name}': node: {thing.node}; "
                        f"the scene has {len(self.nodes)}"
                    )
        for instance in self.instances:
            self._check_deformation(instance)
        self._check_places()

    def _check_places(self) -> None:
        """Check that instances on nodes stand where these are at rest: a pose would put them there,
        whatever their own matrix says. Instances of skins stand where their joints are."""
        on_nodes = [i for i in self.instances if i.node is not None and i.skin is None]
        if not on_nodes:
            return
        world_from_node = self.nodes.world()
        for instance in on_nodes:
            at_rest = world_from_node[instance.node]
            if not np.allclose(at_rest, instance.world_from_local, rtol=1e-9, atol=0.0):
                raise SceneError(
                    f"instance '{instance.name}': world_from_local: differs from where its node "
                    f"{instance.node} is at rest; give node None, or start from Scene.posed()"
                )

    def _check_deformation(self, instance: Instance) -> None:
        """Check an instance's weights and skin against its mesh."""
        label, mesh = f"instance '{instance.name}'", self.meshes[instance.mesh]
        if len(instance.weights) != mesh.target_count:
            raise SceneError(
                f"{label}: weights: {len(instance.weights)}; mesh '{mesh.name}' has "
                f"{mesh.target_count} morph targets"
            )
        if instance.skin is None:
            return
        if not 0 <= instance.skin < len(self.skins):
            raise SceneError(f"{label}: skin: {instance.skin}; the scene has {len(self.skins)}")
        joints = len(self.skins[instance.skin].joints)
        if mesh.influences is None or len(mesh.influences.joint_shares) > joints:
            named = 0 if mesh.influences is None else len(mesh.influences.joint_shares)
            raise SceneError(
                f"{label}: skin: of {joints} joints; mesh '{mesh.name}' names {named}, "
                f"give it 1 to {joints}"
            )

    @property
    def triangle_count(self) -> int:
        """Triangles drawn: each mesh counts once an instance."""
        return sum(len(self.meshes[i.mesh].triangles) for i in self.instances)

    def deforms(self, instance: Instance) -> bool:
        """Whether more than a matrix moves an instance's vertices: a skin or morph targets."""
        return instance.skin is not None or self.meshes[instance.mesh].morph is not None

    def posed(self, pose: Pose | None = None) -> Scene:
        """The scene as it stands in a pose, at rest by default, without anything left to move:
        instances in the same order, those that deform each with a mesh of its own. For checks and
        bounds; the renderer takes poses as they are. Raises SceneError where the pose does not fit.
        """
        from lfd_render.scene.pose import Poser  # noqa: PLC0415 (it imports this module)

        return Poser(self).scene(pose)

    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Smallest and largest world coordinates at rest, each [3] float64, over all instances but
        those that are scaled to a line or a point, unless all are."""
        low, high = self._bounds
        return low.copy(), high.copy()

    @cached_property
    def _bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        from lfd_render.scene.pose import Poser  # noqa: PLC0415 (it imports this module)

        poser = Poser(self)
        posed = poser()
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for index in _spread(posed.world_from_instance):
            instance, world_from_local = self.instances[index], posed.world_from_instance[index]
            positions: NDArray[np.floating] = self.meshes[instance.mesh].positions
            if self.deforms(instance):
                positions, _ = poser.vertices(index, posed)
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


def _spread(world_from_instance: NDArray[np.float64]) -> list[int]:
    """Instances that are not scaled to a line or a point; all, if there is no other."""
    spread: list[int] = np.flatnonzero(
        np.linalg.matrix_rank(world_from_instance[:, :3, :3]) > 1
    ).tolist()
    return spread or list(range(len(world_from_instance)))

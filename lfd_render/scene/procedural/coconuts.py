"""`builtin:coconuts`: hairy coconuts on palm fronds, which leave much of the view empty.

The window is 2 units high round the origin. Fibres and leaflets are thin: most triangles are far
smaller than a pixel of a view, and most of what is drawn is hidden by what lies before it.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from lfd_render.scene.model import Instance, Mesh, Scene
from lfd_render.scene.procedural import materials as paint
from lfd_render.scene.procedural.grid import Surface, tessellate
from lfd_render.scene.procedural.parts import at, mapped, triples
from lfd_render.scene.procedural.shapes import lathe, rounded, sphere

Floats = NDArray[np.float32]

_SETS = (paint.husk, paint.frond, paint.flesh)
_HUSK, _FROND, _FLESH = range(len(_SETS))
_RADIUS, _LONG = 0.42, 1.14  # of a nut; how much longer than wide
# x, y, z, yaw, tilt of whole nuts, in degrees.
_NUTS = (
    (-0.62, -0.36, 0.10, 20, 72),
    (0.05, -0.42, 0.28, 130, 98),
    (0.66, -0.36, 0.02, 250, 65),
    (-0.25, 0.22, -0.18, 75, 110),
    (0.42, 0.20, -0.30, 310, 80),
)
_FRONDS = tuple((40.0 * i + 11 * (i % 2), 8.0 + 9.0 * (i % 3)) for i in range(9))  # yaw, lift
_LEAFLETS = 88  # of a frond
_SHARES = {"fibres": 0.50, "fronds": 0.34}  # of all triangles; the rest are nuts
_FIBRE_STEPS, _LEAF_ACROSS = 6, 4


def coconuts(triangles: int, textures: int) -> Scene:
    """Five nuts, a sixth in two halves, and nine fronds; maps of `textures`² texels."""
    rng = np.random.default_rng(2024)
    per_fibre = 6 * _FIBRE_STEPS
    fibres = max(20, round(_SHARES["fibres"] * triangles / (len(_NUTS) * per_fibre)))
    along = round(_SHARES["fronds"] * triangles / (len(_FRONDS) * _LEAFLETS * 2 * _LEAF_ACROSS))
    hair = _hair(rng, fibres)
    frond = _frond(max(2, along))
    rest = triangles - len(_NUTS) * len(hair.triangles) - len(_FRONDS) * len(frond.triangles)
    solids, counts = _solids()
    meshes = [*tessellate(solids, counts, rest), hair, frond]
    whole = [at(x, y, z, yaw, tilt_deg=tilt) for x, y, z, yaw, tilt in _NUTS]
    halves = [at(-0.98, -0.66, 0.5, 0, tilt_deg=-28), at(0.98, -0.66, 0.46, 40, tilt_deg=32)]
    places = [
        whole, halves, halves, whole,
        [at(0.0, -0.6, -0.2, yaw, tilt_deg=lift, size=1.2) for yaw, lift in _FRONDS],
    ]  # fmt: skip
    with ThreadPoolExecutor(2) as pool:
        sets = list(pool.map(lambda make: make(textures).images(), _SETS))
    names = ("husk", "frond", "flesh")
    return Scene(
        name="coconuts",
        meshes=tuple(meshes),
        instances=tuple(
            Instance(mesh.name, i, place)
            for i, (mesh, stand) in enumerate(zip(meshes, places, strict=True))
            for place in stand
        ),
        materials=tuple(
            mapped(name, 3 * i, 3 * i + 1, double_sided=name == "frond")
            for i, name in enumerate(names)
        ),
        images=triples(sets),
        default_camera={
            "target": [0.0, 0.0, 0.0],
            "eye_direction": [0.0, 0.28, 1.0],
            "up": [0.0, 1.0, 0.0],
            "window_height": 2.2,
        },
    )


def _solids() -> tuple[list[Surface], list[int]]:
    """A nut, the shell of a half and its flesh, and how often each stands."""
    nut = Surface(
        "nut", sphere(_RADIUS, _knobs), (2.6, 1.3), _HUSK, closed_u=True, poles=True,
        uv_scale=(3.0, 1.0), least=(8, 5),
    )  # fmt: skip
    r = 0.36
    bowl = [(0.96 * r * np.sin(a), -0.96 * r * np.cos(a)) for a in np.linspace(1.5, 0.1, 8)]
    outside = [(r * np.sin(a), -r * np.cos(a)) for a in np.linspace(1.57, 0.1, 8)]
    inside = [(0.82 * r * np.sin(a), -0.80 * r * np.cos(a)) for a in np.linspace(0.1, 1.5, 8)]
    shell = Surface(
        "shell", lathe(rounded([(0.0, bowl[-1][1]), *bowl[::-1], *outside, (0.0, -r)])),
        (2.3, 1.2), _HUSK, closed_u=True, poles=True, uv_scale=(3.0, 2.0), least=(8, 6),
    )  # fmt: skip
    white = Surface(
        "flesh", lathe(rounded([(0.0, -0.8 * r), *inside, *bowl, (0.0, bowl[-1][1])])),
        (2.2, 1.0), _FLESH, closed_u=True, poles=True, uv_scale=(3.0, 2.0), least=(8, 6),
    )  # fmt: skip
    return [nut, shell, white], [len(_NUTS), 2, 2]


def _knobs(u: Floats, v: Floats) -> Floats:
    """Longer than wide, with three ridges and shallow furrows that run along."""
    turn = np.float32(2 * np.pi)
    axis = np.cos(v * np.float32(np.pi)) ** 2
    ridges = 0.03 * np.cos(3 * turn * u) + 0.008 * np.cos(turn * (37 * u + np.sin(turn * v)))
    relief: Floats = (_LONG - 1) * axis + ridges * np.sin(v * np.float32(np.pi))
    return relief


def _hair(rng: np.random.Generator, count: int) -> Mesh:
    """Fibres that lie along a nut and stand off it at their tips: tapered tubes of three sides."""
    t = np.linspace(0.0, 1.0, _FIBRE_STEPS + 1)[None, :]

    def random(low: float, high: float) -> NDArray[np.float64]:
        return rng.uniform(low, high, (count, 1))

    longitude = random(0, 2 * np.pi) + random(-0.25, 0.25) * t
    down = np.arccos(random(-0.96, 1.0)) + random(0.15, 0.75) * t
    stand = 0.005 + random(0.0, 0.16) ** 1.5 * t**2 * 2.0
    u, v = longitude / (2 * np.pi), down / np.pi
    radius = _RADIUS * (1 + _knobs(u.astype(np.float32), v.astype(np.float32))) + stand
    outward = np.stack(
        (np.sin(down) * np.sin(longitude), np.cos(down), np.sin(down) * np.cos(longitude)), -1
    )
    middle = outward * radius[..., None]
    along = np.gradient(middle, axis=1)
    side = np.cross(along, outward)
    side /= np.linalg.norm(side, axis=-1, keepdims=True)
    up = np.cross(side, along)
    up /= np.linalg.norm(up, axis=-1, keepdims=True)
    angle = 2 * np.pi * np.arange(4) / 3  # the first side once more at the end, for its texture
    direction = (
        np.cos(angle)[:, None] * side[:, :, None, :] + np.sin(angle)[:, None] * up[:, :, None, :]
    )
    thick = random(0.0015, 0.0038) * (1.02 - t)
    positions = middle[:, :, None, :] + thick[..., None, None] * direction
    around = np.broadcast_to(np.arange(4) / 3, positions.shape[:3])
    down_texture = np.broadcast_to(t[..., None], positions.shape[:3])
    return _strips(
        "fibres", _HUSK, positions=positions, normals=direction, u=around, v=down_texture
    )


def _frond(steps: int) -> Mesh:
    """A stem along +x that arches, and folded leaflets on both of its sides, each so many cells
    long, four across."""
    index = np.arange(_LEAFLETS)
    side = np.where(index % 2, 1.0, -1.0)[:, None, None]
    place = ((index // 2 + 0.5) / (_LEAFLETS / 2))[:, None, None]  # along the stem
    t = np.linspace(0.0, 1.0, steps + 1)[None, :, None]
    across = np.linspace(-1.0, 1.0, _LEAF_ACROSS + 1)[None, None, :]
    reach, width = 0.62 * np.sin(np.pi * (0.12 + 0.82 * place)), 0.022
    narrowing = np.sin(np.pi * (0.08 + 0.9 * t) ** 0.7)
    x = 0.15 + 1.35 * place + 0.75 * reach * t + side * width * narrowing * across
    z = side * reach * (0.8 * t + 0.03) - 0.5 * width * narrowing * across
    stem = 0.42 * np.sin(1.9 * place)
    y = (
        stem
        + 0.10 * t
        - 0.30 * t**2 * (0.6 + 0.5 * place)
        - 0.5 * width * narrowing * np.abs(across)
    )
    positions = np.stack(np.broadcast_arrays(x, y, z), axis=-1)
    du, dv = np.gradient(positions, axis=2), np.gradient(positions, axis=1)
    normals = np.cross(dv, du)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    u = np.broadcast_to(0.5 + 0.5 * across, positions.shape[:3])
    v = np.broadcast_to(t, positions.shape[:3])
    return _strips("fronds", _FROND, positions=positions, normals=normals, u=u, v=v)


def _strips(
    name: str,
    material: int,
    *,
    positions: NDArray[np.float64],
    normals: NDArray[np.float64],
    u: NDArray[np.float64],
    v: NDArray[np.float64],
) -> Mesh:
    """Many grids of one size as a mesh: positions and normals [grid, row, column, xyz]."""
    count, rows, columns = positions.shape[:3]
    vertices = count * rows * columns
    corner = np.arange(vertices, dtype=np.uint32).reshape(count, rows, columns)
    a, b, c, d = corner[:, :-1, :-1], corner[:, 1:, :-1], corner[:, :-1, 1:], corner[:, 1:, 1:]
    cells = np.stack((np.stack((a, b, c), -1), np.stack((c, b, d), -1)), axis=-2)
    texcoords = np.repeat(np.stack((u, v), -1).reshape(vertices, 1, 2), 2, axis=1)
    return Mesh(
        name=name,
        positions=positions.reshape(vertices, 3).astype(np.float32),
        normals=normals.reshape(vertices, 3).astype(np.float32),
        texcoords=texcoords.astype(np.float32),
        colors=np.ones((vertices, 4), np.float32),
        triangles=cells.reshape(-1, 3),
        material=material,
    )

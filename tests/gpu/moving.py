"""Scenes that move, for tests: a bending reed, and random nodes, skins and morphs.

As a program it renders the reed in a pose with a new process: `python moving.py OUT.npy`.
"""

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Camera, DisplayProfile
from lfd_render.renderer import Renderer
from lfd_render.scene import (
    NO_PARENT,
    Influences,
    Instance,
    Light,
    Material,
    Mesh,
    Morph,
    Nodes,
    Pose,
    Scene,
    Skin,
    node_transform,
)

SMALL = {"views": 8, "view_size": (64, 48)}  # so many share what they see


def turn(axis: int, angle_rad: float, **more: Any) -> NDArray[np.float64]:
    """parent_from_node of a node turned about an axis."""
    rotation = np.zeros(4)
    rotation[[axis, 3]] = np.sin(0.5 * angle_rad), np.cos(0.5 * angle_rad)
    return node_transform(rotation=rotation, **more)


def mesh(positions: NDArray[Any], triangles: NDArray[Any], material: int = 0, **more: Any) -> Mesh:
    """A mesh of one white material; flat unless it is given normals."""
    count = len(positions)
    normals = more.pop("normals", np.tile([0.0, 0.0, 1.0], (count, 1)))
    return Mesh(
        "moving",
        positions.astype(np.float32),
        normals.astype(np.float32),
        np.zeros((count, 2, 2), np.float32),
        np.ones((count, 4), np.float32),
        triangles.astype(np.uint32),
        material,
        **more,
    )


def strip(segments: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Positions and triangles of an upright strip, 1 wide and 4 high, its foot at the origin."""
    height = np.repeat(np.linspace(0.0, 4.0, segments + 1), 2)
    side = np.tile([-0.5, 0.5], segments + 1)
    low = 2 * np.arange(segments)[:, None]
    triangles = np.concatenate([low + np.array([0, 1, 3]), low + np.array([0, 3, 2])])
    return np.stack([side, height, np.zeros_like(side)], axis=1), triangles


def reed() -> Scene:
    """A strip on two joints, 0 and `tip`, with a morph target that widens it, beside a leaf that a
    node carries; a spot light before the tip hangs on it."""
    positions, triangles = strip(8)
    high = positions[:, 1] > 2.0
    joints = np.tile(np.array([0, 1, 0, 0], np.uint16), (len(positions), 1))
    share = np.clip((positions[:, 1] - 1.0) / 2.0, 0.0, 1.0)
    weights = np.stack([1.0 - share, share, 0 * share, 0 * share], axis=1)
    wider = positions * [1.0, 0.0, 0.0] * high[:, None]
    stem = mesh(
        positions,
        triangles,
        morph=Morph(np.float32(wider[None]), np.zeros((1, len(positions), 3), np.float32)),
        influences=Influences.scaled(joints, weights),
    )
    leaf = mesh(*strip(1), material=1)
    nodes = Nodes(
        ("foot", "tip", "leaf", "reed", "lamp"),
        np.array([NO_PARENT, 0, NO_PARENT, NO_PARENT, 1]),
        np.stack(
            [
                np.eye(4),
                node_transform((0.0, 2.0, 0.0)),
                node_transform((2.0, 0.0, 0.0)),
                node_transform((0.0, 9.0, 0.0)),
                node_transform((0.0, 1.0, 3.0)),
            ]
        ),
    )
    bind = np.stack([np.eye(4), node_transform((0.0, -2.0, 0.0))])
    aside = node_transform((2.0, 3.0, 4.0))
    return Scene(
        "reed",
        (stem, leaf),
        (
            Instance("reed", 0, np.eye(4), 3, 0, (0.0,)),
            Instance("leaf", 1, nodes.world()[2], 2),
        ),
        (
            Material("stem", (0.3, 0.7, 0.2, 1.0), 0.0, 0.8, double_sided=True),
            Material("leaf", (0.8, 0.3, 0.1, 1.0), 0.0, 0.5, double_sided=True),
        ),
        lights=(
            Light("still", "point", aside, intensity=30.0),
            Light("lamp", "spot", nodes.world()[4], (1.0, 0.4, 0.2), 90.0, node=4),
        ),
        nodes=nodes,
        skins=(Skin("reed", np.array([0, 1]), bind),),
    )


def reed_camera(display: DisplayProfile) -> Camera:
    """A window around the reed."""
    del display
    return Camera((0.5, 2.2, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), 5.0)


def reed_pose(time: float) -> Pose:
    """The reed in the wind: its tip swings, its leaf turns, it grows wider."""
    return Pose(
        {
            "tip": turn(2, 0.5 * np.sin(time), translation=(0.0, 2.0, 0.0)),
            "leaf": turn(1, 0.8 * np.cos(time), translation=(2.0, 0.3 * np.sin(time), 0.0)),
        },
        {"reed": (0.4 + 0.4 * np.sin(2.0 * time),)},
    )


def random_moving(rng: np.random.Generator, count: int = 12) -> tuple[Scene, Pose]:
    """A random tree of nodes that carries meshes of every kind, and a random pose of it."""
    node_count = 8
    nodes = Nodes(
        tuple(f"node {i}" for i in range(node_count)),
        np.array([NO_PARENT, *(int(rng.integers(-1, i)) for i in range(1, node_count))]),
        np.stack([random_transform(rng) for _ in range(node_count)]),
    )
    skins = tuple(
        Skin(
            f"skin {size}",
            rng.integers(0, node_count, size),
            np.stack([random_transform(rng) for _ in range(size)]),
        )
        for size in (3, 6)
    )
    materials = (
        Material("solid"),
        Material("mask", alpha_mode="mask"),
        Material("glass", (1.0, 1.0, 1.0, 0.5), alpha_mode="blend"),
    )
    meshes, instances = [], []
    world = nodes.world()
    for flat in (False, True):
        for sets, targets in ((0, 0), (1, 0), (0, 3), (2, 5), (1, 2)):
            material = int(rng.integers(0, 3))
            meshes.append(random_mesh(rng, count, material, flat=flat, sets=sets, targets=targets))
            for _ in range(int(rng.integers(1, 3))):
                node = int(rng.integers(0, node_count))
                instances.append(
                    Instance(
                        f"{len(meshes)}",
                        len(meshes) - 1,
                        np.eye(4) if sets else world[node],
                        node,
                        int(rng.integers(0, 2)) if sets else None,
                        tuple(rng.uniform(-1, 1, targets)),
                    )
                )
    order = rng.permutation(len(instances))
    scene = Scene(
        "random", tuple(meshes), tuple(instances[i] for i in order), materials, nodes=nodes,
        skins=skins,
    )  # fmt: skip
    transforms = {int(node): random_transform(rng) for node in rng.permutation(node_count)[:4]}
    morphed = [i for i in instances if i.weights and rng.random() < 0.5]
    counts: dict[int, set[int]] = {}
    for instance in instances:
        if instance.weights and instance.node is not None:
            counts.setdefault(instance.node, set()).add(len(instance.weights))
    weights = {
        i.node: rng.uniform(-1, 2, len(i.weights))
        for i in morphed
        if i.node is not None and len(counts[i.node]) == 1
    }
    return scene, Pose(transforms, weights)


def random_transform(rng: np.random.Generator) -> NDArray[np.float64]:
    """A turn of up to half a radian, a stretch, sometimes a mirror, a move."""
    axis = rng.normal(size=3)
    half = rng.uniform(-0.25, 0.25)
    scale = rng.uniform(0.8, 1.25, 3)
    if rng.random() < 0.15:
        scale[0] *= -1.0
    rotation = (*(axis / np.linalg.norm(axis) * np.sin(half)), np.cos(half))
    return node_transform(rng.uniform(-5, 5, 3), rotation, scale)


def random_mesh(
    rng: np.random.Generator, count: int, material: int, *, flat: bool, sets: int, targets: int
) -> Mesh:
    """Random triangles with what moves them; most displacements are zero."""
    vertices = 3 * count if flat else 2 * count
    positions = rng.uniform(-40, 40, (vertices, 3))
    triangles = (
        np.arange(vertices).reshape(-1, 3) if flat else rng.integers(0, vertices, (count, 3))
    )
    normals = rng.normal(size=(vertices, 3))
    moved = rng.random((targets, vertices, 1)) < 0.4
    morph = Morph(
        np.float32(moved * rng.uniform(-10, 10, (targets, vertices, 3))),
        np.float32(moved * rng.uniform(-0.2, 0.2, (targets, vertices, 3))),
    ) if targets else None  # fmt: skip
    influences = Influences.scaled(
        rng.integers(0, 3, (vertices, 4 * sets)),
        rng.uniform(0, 1, (vertices, 4 * sets)) * (rng.random((vertices, 4 * sets)) < 0.5),
    ) if sets else None  # fmt: skip
    return mesh(
        positions,
        triangles,
        material,
        normals=normals / np.linalg.norm(normals, axis=1, keepdims=True),
        morph=morph,
        influences=influences,
        flat=flat,
    )


if __name__ == "__main__":
    profile = DisplayProfile.load("gavane-2024-tilted-4k")
    with Renderer() as renderer:
        pictures = renderer.views(
            reed(), profile, reed_camera(profile), pose=reed_pose(1.0), **SMALL
        )
    np.save(sys.argv[1], pictures)

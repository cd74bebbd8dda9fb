"""Which arrays the textures of a scene go to, so that they fit a device's units and memory.

Plain arithmetic on sizes; no pixels and no OpenGL.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import ResourceError
from lfd_render.gpu.device import DeviceInfo

# The environment, what a pass goes through (blocks, or rows of points), and what geometry and
# materials are fetched from: triangles, draws, vertices, their two kinds of attributes, materials.
RESERVED_UNITS = 8
_MOST_KINDS = 256  # that are merged pair by pair; more are first brought to steps of sizes
_GIB = 1 << 30

Size = tuple[int, int]  # width, height
_Kind = tuple[tuple[bool, tuple[str, str]], Size]  # family, size


@dataclass(frozen=True)
class Map:
    """One image as some materials read it: with or without sRGB decoding, wrapped in s and t."""

    image: int
    srgb: bool
    wrap: tuple[str, str]

    @property
    def family(self) -> tuple[bool, tuple[str, str]]:
        """What maps of one array share beside their size."""
        return self.srgb, self.wrap


@dataclass(frozen=True)
class ArrayPlan:
    """One array: the size of its layers, and the map that each layer holds."""

    size: Size
    maps: tuple[Map, ...]


def mip_bytes(size: Size) -> int:
    """Bytes of one RGBA8 layer with all its levels."""
    width, height = size
    levels = max(size).bit_length()
    return 4 * sum(max(1, width >> level) * max(1, height >> level) for level in range(levels))


def plan_arrays(
    maps: Sequence[Map], sizes: Sequence[Size], names: Sequence[str], info: DeviceInfo
) -> tuple[list[ArrayPlan], list[str]]:
    """Arrays for distinct maps, and warnings about what is not kept at its own size.

    sizes, names: by image. Images are halved until each, and all together, fit the device's
    memory; kinds of like size are brought to the larger size until the texture units suffice.
    Raises ResourceError for more maps than all units hold.
    """
    fitted = {m.image: _halved(sizes[m.image], info) for m in maps}
    most_texels = max((w * h for w, h in fitted.values()), default=0)
    while True:
        arrays = _arrays(maps, fitted, info)
        if _fits(arrays, info):
            return arrays, _warnings(arrays, fitted, sizes, names, info)
        most_texels //= 4
        if most_texels < 1:
            raise ResourceError(
                f"textures: {len(maps)} different ones need {len(arrays)} arrays of up to "
                f"{info.max_array_layers} layers; {info.renderer} has {_units(info)} units for "
                "them, use fewer textures"
            )
        for image, size in fitted.items():
            fitted[image] = _within(size, most_texels)


def _units(info: DeviceInfo) -> int:
    return info.max_texture_units - RESERVED_UNITS


def _halved(size: Size, info: DeviceInfo) -> Size:
    """A size halved until the device holds one such texture."""
    while max(size) > info.max_texture_size or mip_bytes(size) > info.max_texture_bytes:
        size = max(1, size[0] // 2), max(1, size[1] // 2)
    return size


def _within(size: Size, most_texels: int) -> Size:
    while size[0] * size[1] > most_texels and max(size) > 1:
        size = max(1, size[0] // 2), max(1, size[1] // 2)
    return size


def _fits(arrays: Sequence[ArrayPlan], info: DeviceInfo) -> bool:
    layers = [mip_bytes(array.size) for array in arrays]
    total = sum(size * len(a.maps) for size, a in zip(layers, arrays, strict=True))
    return (
        len(arrays) <= _units(info)
        and max(layers, default=0) <= info.max_texture_bytes
        and total <= info.texture_budget_bytes
    )


def _arrays(maps: Sequence[Map], fitted: Mapping[int, Size], info: DeviceInfo) -> list[ArrayPlan]:
    """Maps in arrays by family and size, as many as their layers need."""
    place = _merged(Counter((m.family, fitted[m.image]) for m in maps), info)
    held: dict[_Kind, list[Map]] = {}
    for one in maps:
        held.setdefault(place[one.family, fitted[one.image]], []).append(one)
    arrays = []
    for (_, size), layers in held.items():
        most = _most_layers(size, info)
        parts = (layers[first : first + most] for first in range(0, len(layers), most))
        arrays += [ArrayPlan(size, tuple(part)) for part in parts]
    return arrays


def _most_layers(size: Size, info: DeviceInfo) -> int:
    return min(info.max_array_layers, max(1, info.max_texture_bytes // mip_bytes(size)))


def _merged(counts: Mapping[_Kind, int], info: DeviceInfo) -> dict[_Kind, _Kind]:
    """What each kind is brought to, so that all need no more arrays than there are units.

    Kinds of one family merge into the least size that holds both, the pair first whose textures
    are enlarged least. Very many kinds are first brought to common steps of sizes.
    """
    step = 1.0 / 16.0
    place = {kind: kind for kind in counts}
    while len(set(place.values())) > max(_MOST_KINDS, _units(info)):
        place = {kind: (kind[0], _stepped(kind[1], step, info)) for kind in counts}
        step *= 2.0
    layers = Counter[_Kind]()
    for kind, count in counts.items():
        layers[place[kind]] += count
    into = _merge_pairs(layers, info)
    return {kind: into[place[kind]] for kind in counts}


def _stepped(size: Size, octaves: float, info: DeviceInfo) -> Size:
    """A size with each side enlarged to the next whole step of so many octaves."""
    steps = np.ceil(np.log2(size) / octaves - 1e-9)  # what is on a step stays there
    width, height = np.minimum(np.ceil(np.exp2(steps * octaves) - 1e-6), info.max_texture_size)
    return int(width), int(height)


def _merge_pairs(counts: Mapping[_Kind, int], info: DeviceInfo) -> dict[_Kind, _Kind]:
    kinds = list(counts)
    family = np.unique([str(kind[0]) for kind in kinds], return_inverse=True)[1]
    size = np.array([kind[1] for kind in kinds], np.int64).reshape(-1, 2)
    layers = np.array([counts[kind] for kind in kinds], np.int64)
    group = np.arange(len(kinds))
    arrays = np.array([_array_count(kind[1], counts[kind], info) for kind in kinds], np.int64)

    def octaves(row: int) -> NDArray[np.float64]:
        """Doublings of area, summed over layers, if merged with each other kind; ∞ where not."""
        both = np.log2(np.maximum(size[row], size)).sum(axis=1)
        own = np.log2(size).sum(axis=1)
        cost: NDArray[np.float64] = (both - own) * layers + (both - own[row]) * layers[row]
        cost[(family != family[row]) | (layers == 0)] = np.inf
        cost[row] = np.inf
        return cost

    rows = [octaves(row) for row in range(len(kinds))]
    costs = np.array(rows).reshape(len(kinds), len(kinds))
    while arrays.sum() > _units(info) and np.isfinite(costs).any():
        keep, gone = divmod(int(costs.argmin()), len(kinds))
        size[keep] = np.maximum(size[keep], size[gone])
        layers[keep] += layers[gone]
        layers[gone] = arrays[gone] = 0
        group[group == gone] = keep
        wide, high = size[keep].tolist()
        arrays[keep] = _array_count((wide, high), int(layers[keep]), info)
        costs[gone] = costs[:, gone] = np.inf
        costs[keep] = costs[:, keep] = octaves(keep)
    return {
        kind: (kind[0], (int(size[place, 0]), int(size[place, 1])))
        for kind, place in zip(kinds, group, strict=True)
    }


def _array_count(size: Size, layers: int, info: DeviceInfo) -> int:
    return -(-layers // _most_layers(size, info))


def _warnings(
    arrays: Sequence[ArrayPlan],
    fitted: Mapping[int, Size],
    sizes: Sequence[Size],
    names: Sequence[str],
    info: DeviceInfo,
) -> list[str]:
    warnings = []
    reduced = [image for image, size in fitted.items() if size != sizes[image]]
    if reduced:
        worst = max(reduced, key=lambda image: sizes[image][0] * sizes[image][1])
        warnings.append(
            f"{len(reduced)} of {len(fitted)} textures are reduced, image '{names[worst]}' from "
            f"{_text(sizes[worst])} to {_text(fitted[worst])}: this device's textures may have "
            f"{info.max_texture_size} texels a side, {info.max_texture_bytes / _GIB:.3g} GiB each "
            f"and {info.texture_budget_bytes / _GIB:.3g} GiB together"
        )
    enlarged = {
        (m.family, fitted[m.image]): array.size
        for array in arrays
        for m in array.maps
        if fitted[m.image] != array.size
    }
    if enlarged:
        stretch = max(max(into[0] / s[0], into[1] / s[1]) for (_, s), into in enlarged.items())
        kinds = len({(m.family, fitted[m.image]) for array in arrays for m in array.maps})
        warnings.append(
            f"textures of {len(enlarged)} sizes are enlarged, by up to {stretch:.3g} a side: the "
            f"scene has {kinds} kinds of size, wrap and colour space, the device "
            f"{_units(info)} texture units"
        )
    return warnings


def _text(size: Size) -> str:
    return f"{size[0]}×{size[1]}"

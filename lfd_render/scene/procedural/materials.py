"""The texture sets of the built-in scenes: stone, cloths, plaster, metals, paintings, husks."""

from __future__ import annotations

import numpy as np

from lfd_render.scene.procedural.textures import Field, TextureSet, grid, mix, noise, rgb, ridge

_PI = np.float32(np.pi)


def floor_tiles(size: int, seed: int = 11) -> TextureSet:
    """Four by four polished marble tiles, black and cream, with sunken joints."""
    u, v = grid(size)
    tiles = 4
    across, down = u * tiles, v * tiles
    dark = ((across.astype(np.int32) + down.astype(np.int32)) % 2).astype(np.float32)
    edge = np.minimum(np.minimum(across % 1, 1 - across % 1), np.minimum(down % 1, 1 - down % 1))
    joint = np.clip(1.0 - edge / np.float32(0.012), 0.0, 1.0).astype(np.float32)
    veins = _veins(size, seed, 2.0)
    clouds = noise(size, seed + 1, 1.8)
    light = mix(rgb("e6dcc8"), rgb("a58a66"), 0.65 * veins + 0.06 * clouds)
    black = mix(rgb("1d1b1e"), rgb("b9ad9a"), 0.55 * np.roll(veins, size // 3, axis=1) ** 2)
    color = mix(mix(light, black, dark), rgb("4a4238"), joint)
    height = -0.004 * joint + 0.00004 * clouds
    roughness = 0.16 + 0.05 * np.clip(clouds, -1, 2) + 0.55 * joint
    return TextureSet("floor tiles", color, height, roughness.astype(np.float32))


def damask(size: int) -> TextureSet:
    """Deep red wall cloth: staggered rosettes in a net of lines, smoother than the ground."""
    u, v = grid(size)
    across, down = u * 3, v * 2
    net = np.cos(2 * _PI * across) + np.cos(2 * _PI * down)
    net = net + 0.5 * np.cos(4 * _PI * across) * np.cos(2 * _PI * down)
    lines = np.maximum(0.14 - np.abs(np.abs(net) - 0.28), 0.0) * 18
    ornament = np.clip(lines + _rosettes(across, down) + _rosettes(across + 0.5, down + 0.5), 0, 1)
    thread = np.sin(2 * _PI * 160 * v) * np.float32(0.5) + np.sin(2 * _PI * 160 * u) * 0.5
    worn = noise(size, 21, 1.4)
    color = mix(rgb("6b1521"), rgb("93373a"), 0.85 * ornament + 0.07 * worn)
    color *= 1.0 + 0.04 * thread + 0.02 * worn
    height = (0.0009 * ornament + 0.00015 * thread + 0.00005 * worn).astype(np.float32)
    roughness = (0.85 - 0.28 * ornament + 0.03 * worn).astype(np.float32)
    return TextureSet("damask", color, height, roughness)


def _rosettes(across: Field, down: Field) -> Field:
    """An eight-petalled flower with a ring in each unit cell, 1 inside and 0 outside."""
    x, y = across % 1 - np.float32(0.5), (down % 1 - np.float32(0.5)) * np.float32(1.3)
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    petals = np.float32(0.21) * (np.float32(0.72) + np.float32(0.28) * np.cos(8 * angle)) - radius
    ring = np.float32(0.012) - np.abs(radius - np.float32(0.075))
    shape: Field = np.clip(70 * petals, 0, 1) - np.clip(120 * ring, 0, 1)
    return shape


def plaster(size: int) -> TextureSet:
    """Warm white plaster, brushed and a little uneven."""
    rough = noise(size, 31, 1.1, 6.0)
    stains = noise(size, 32, 1.9)
    color = mix(rgb("e9e2d3"), rgb("c9bda5"), 0.35 + 0.16 * stains + 0.1 * rough)
    return TextureSet("plaster", color, 0.0006 * rough, 0.9 + 0.03 * rough)


def marble(size: int) -> TextureSet:
    """White marble with grey veins."""
    veins = _veins(size, 41, 1.5)
    clouds = noise(size, 42, 1.9)
    color = mix(rgb("efece6"), rgb("7d7f86"), 0.75 * veins**1.5 + 0.1 + 0.08 * clouds)
    return TextureSet("marble", color, 0.0003 * noise(size, 43, 1.2, 8.0), 0.28 + 0.12 * veins)


def granite(size: int) -> TextureSet:
    """Dark speckled granite."""
    grain = noise(size, 51, 0.2, 60.0)
    flakes = noise(size, 52, 0.3, 40.0)
    color = mix(rgb("34343a"), rgb("9a948e"), 0.35 * grain + 0.12)
    color = mix(color, rgb("120f12"), 1.4 * flakes - 1.1)
    return TextureSet("granite", color, 0.0004 * grain, 0.38 + 0.06 * flakes)


def _bonded(size: int, across: int, down: int, joint: float) -> tuple[Field, Field]:
    """Blocks in running bond: 1 in the joints and 0 off them, and a number of its own a block."""
    u, v = grid(size)
    row = (v * down).astype(np.int32)
    x = u * across + 0.5 * (row % 2)
    edge_x = np.minimum(x % 1, 1 - x % 1) / across
    edge_y = np.minimum(v * down % 1, 1 - v * down % 1) / down
    line = np.clip(2.0 - np.minimum(edge_x, edge_y) / np.float32(joint), 0.0, 1.0)
    column = (x % across).astype(np.int32)
    tone = np.random.default_rng(across * 100 + down).random((down, across), np.float32)
    return line.astype(np.float32), tone[row, column]


def ashlar(size: int) -> TextureSet:
    """Sandstone blocks of slightly different colours, tooled and worn."""
    joints, tone = _bonded(size, 4, 8, 0.004)
    tooled, stains = noise(size, 101, 0.9, 10.0), noise(size, 102, 1.8)
    color = mix(rgb("d8c49a"), rgb("b39468"), 0.7 * tone + 0.12 * stains + 0.08 * tooled)
    color = mix(color, rgb("7d6a4e"), 0.8 * joints)
    height = -0.003 * joints + 0.0007 * tooled
    return TextureSet("ashlar", color, height.astype(np.float32), 0.88 + 0.03 * tooled)


def brick(size: int) -> TextureSet:
    """Old red bricks in wide joints."""
    joints, tone = _bonded(size, 8, 24, 0.0035)
    grain, stains = noise(size, 111, 0.8, 12.0), noise(size, 112, 1.7)
    color = mix(rgb("9c5238"), rgb("6b2f24"), tone + 0.1 * grain)
    color = mix(mix(color, rgb("c8b8a0"), 0.9 * joints), rgb("3a2a24"), 0.12 * stains)
    height = -0.003 * joints + 0.0006 * grain
    return TextureSet("brick", color, height.astype(np.float32), 0.9 + 0.03 * grain)


def cloth(size: int, seed: int, ground: str, thread: str) -> TextureSet:
    """Woven cloth with a border and rosettes in another thread."""
    u, v = grid(size)
    ornament = np.clip(_rosettes(u * 4, v * 4) + _rosettes(u * 4 + 0.5, v * 4 + 0.5), 0, 1)
    border = np.maximum(np.abs(u - 0.5), np.abs(v - 0.5))
    ornament = np.maximum(ornament * (border < 0.4), (np.abs(border - 0.43) < 0.012))
    weft = np.sin(2 * _PI * 128 * v) * np.sin(2 * _PI * 128 * u)
    worn = noise(size, seed, 1.5)
    color = mix(rgb(ground), rgb(thread), ornament.astype(np.float32))
    color *= (1.0 + 0.08 * weft + 0.05 * worn).astype(np.float32)
    height = (0.0006 * ornament + 0.0002 * weft).astype(np.float32)
    return TextureSet("cloth", color, height, (0.85 - 0.2 * ornament).astype(np.float32))


def husk(size: int) -> TextureSet:
    """A coconut's brown husk, combed by fibres that run down the texture."""
    fibres = _combed(size, 121, 24)
    stains = noise(size, 123, 1.7)
    color = mix(rgb("8a5e34"), rgb("3d2614"), 0.45 + 0.3 * fibres + 0.1 * stains)
    return TextureSet("husk", color, 0.002 * fibres, 0.9 + 0.03 * fibres)


def frond(size: int) -> TextureSet:
    """A palm leaf: ribs along the texture's v, yellow at its edges and tip."""
    u, v = grid(size)
    ribs = _combed(size, 131, 32)
    middle = np.clip(1 - np.abs(u - 0.5) * 40, 0, 1)
    green = mix(rgb("2f6a22"), rgb("6fa03a"), 0.4 + 0.2 * ribs + 0.3 * v)
    color = mix(green, rgb("c4b45a"), middle + np.clip(v * 5 - 4.2, 0, 1) + 0 * ribs)
    return TextureSet("frond", color, 0.001 * ribs, 0.45 + 0.05 * ribs)


def flesh(size: int) -> TextureSet:
    """The white of a coconut."""
    grain, stains = noise(size, 141, 1.0, 8.0), noise(size, 142, 1.8)
    color = mix(rgb("f6f1e4"), rgb("e2d8c0"), 0.4 + 0.2 * stains + 0.1 * grain)
    return TextureSet("flesh", color, 0.0006 * grain, 0.5 + 0.05 * grain)


def _combed(size: int, seed: int, stretch: int) -> Field:
    """Tiling noise of deviation 1, drawn out `stretch` times along v."""
    field = noise(size, seed, 0.7, 8.0)
    rows = (np.arange(size) // stretch) % size
    steps = noise(size, seed + 1, 1.6)[:, 0] * np.float32(3.0)
    shift = np.rint(steps).astype(np.int64)
    columns = (np.arange(size)[None, :] + shift[:, None]) % size
    combed: Field = field[rows[:, None], columns]
    return combed


def bronze(size: int) -> TextureSet:
    """Cast bronze, polished where it is touched and green where it is not."""
    cast = noise(size, 61, 1.2, 4.0)
    patina = np.clip(noise(size, 62, 1.5) * 0.9 - 0.55, 0.0, 1.0)
    color = mix(rgb("b98a58"), rgb("8a5a30"), 0.4 + 0.2 * cast)
    color = mix(color, rgb("5f8f7d"), patina)
    return TextureSet(
        "bronze", color, 0.0012 * cast, 0.30 + 0.05 * cast + 0.45 * patina, 1.0 - 0.9 * patina
    )


def gilt(size: int) -> TextureSet:
    """Gold leaf over hammered metal: shallow dents without order, and a little wear."""
    dents: Field = np.abs(noise(size, 71, 3.5, 26.0))
    worn = noise(size, 72, 1.6)
    color = mix(rgb("f3d283"), rgb("b98832"), 0.3 + 0.2 * worn + 0.1 * dents)
    return TextureSet("gilt", color, 0.004 * dents, 0.24 + 0.06 * worn, 1.0)


def canvas(size: int) -> TextureSet:
    """The weave and varnish of a painting; its colours come from `painting`."""
    u, v = grid(size)
    weave = np.sin(2 * _PI * 192 * u) * np.sin(2 * _PI * 192 * v)
    strokes = noise(size, 81, 1.0, 8.0)
    height = (0.0002 * weave + 0.0003 * strokes).astype(np.float32)
    color = np.broadcast_to(rgb("d8cdb8"), (3, size, size))
    return TextureSet("canvas", color, height, 0.42 + 0.05 * strokes)


def lamp_glass(size: int) -> TextureSet:
    """Frosted glass with ribs; the same pattern, brighter, is its emission."""
    u, v = grid(size)
    ribs = (np.cos(2 * _PI * 24 * u) + 0 * v).astype(np.float32)
    glow = ((0.8 + 0.2 * ribs) * np.sin(_PI * v) ** 0.4).astype(np.float32)
    color = mix(rgb("a06a30"), rgb("fff0d2"), glow)
    return TextureSet("lamp glass", color, 0.002 * ribs, 0.5)


def painting(size: int, seed: int, sky: str, sun: str, hills: tuple[str, ...]) -> Field:
    """A landscape, [rgb, y, x] in sRGB: sky, sun and ranges of hills that fade with distance."""
    u, v = grid(size)
    clouds = noise(size, seed, 1.7)
    color = mix(rgb(sky), rgb(sun), 1.3 * v - 0.2 + 0.12 * clouds)
    disc = np.hypot(u - np.float32(0.3 + 0.07 * (seed % 5)), (v - 0.3) * 0.8)
    color = mix(color, rgb("fff6dc"), (0.075 - disc) * 60)
    color = mix(color, rgb(sun), 0.6 * np.exp(-((disc / np.float32(0.22)) ** 2)))
    for i, code in enumerate(hills):
        crest = ridge(size, seed + i) * np.float32(0.05 * (1 + 0.3 * i))
        line = crest + np.float32(0.48 + 0.5 * i / len(hills))
        below = slice(max(int(line.min() * size) - 1, 0), None)  # rows that the hills reach
        depth = v[below] - line
        shade = 1.0 + 0.1 * clouds[: size - below.start] - 0.5 * np.maximum(depth, 0.0)
        hill: Field = (rgb(code) * shade).astype(np.float32)
        color[:, below] = mix(color[:, below], hill, depth * 90)
    return color


def _veins(size: int, seed: int, turbulence: float) -> Field:
    """Thin winding lines: 1 on the line and 0 off it."""
    u, v = grid(size)
    warp = noise(size, seed, 1.6)
    lines = np.abs(np.sin(2 * _PI * (u + 2 * v) + turbulence * warp))
    fine = np.abs(noise(size, seed + 1, 1.5))
    strong = np.clip(1.0 - 5.0 * lines, 0.0, 1.0)
    veins: Field = np.maximum(strong, 0.6 * np.clip(1.0 - 12.0 * fine, 0.0, 1.0))
    return veins

"""An environment's picture → what surfaces of every roughness mirror of it, and its irradiance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.gpu.lighting import EnvironmentMap
from lfd_render.gpu.memory import Buffer, CubeMap, TextureArray
from lfd_render.gpu.programs import Kernel
from lfd_render.scene import Environment

LAST_FACE = 8  # texels along an edge of the level of roughness 1
FACES = (256, 512)  # least and most of the level that mirrors read
FEWEST_SAMPLES = 256  # of a lobe, at the smoothest level that is not a mirror
FINEST_ROWS = 256  # least rows of directions that irradiance is summed over
GOLDEN_ANGLE_RAD = np.pi * (3.0 - np.sqrt(5.0))
_GROUP = 8  # local_size_x and _y of the kernels

Float64 = NDArray[np.float64]


class Prefilter:
    """Environment → EnvironmentMap.

    Level 0 of the cube map is the picture; each further level is what GGX of `level_roughness`
    mirrors of it towards an eye straight above (Karis 2013, "Real shading in Unreal Engine 4"), by
    filtered importance sampling (Křivánek and Colbert 2008). Radiance beyond half floats is cut off
    only after it was averaged.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._project = Kernel(device, "prefilter/project.comp")
        self._lobe = Kernel(device, "prefilter/lobe.comp")

    def __call__(self, environment: Environment) -> EnvironmentMap:
        """Prefilter a picture. The map is the caller's to release."""
        face = face_size(environment.pixels.shape[1])
        source = self._cube(environment.pixels, face)
        roughness = level_roughness(face)
        target = CubeMap(self._device, "environment", face, gl.RGBA16F, levels=len(roughness))
        for level, rough in enumerate(roughness):
            lobe = lobe_samples(rough, lobe_count(level), face)
            samples = Buffer.of(self._device, "environment", lobe.astype(np.float32))
            target.bind_image(0, level=level)
            self._lobe.set({"Samples": samples}, {"samples": len(lobe)}, {"source": source})
            self._run(self._lobe, face >> level)
            samples.release()
        source.release()
        return EnvironmentMap(target, irradiance(environment.pixels))

    def _cube(self, pixels: NDArray[np.float32], face: int) -> CubeMap:
        """The picture on the faces of a cube, in full float range, with mip levels."""
        height, width = pixels.shape[:2]
        picture = TextureArray(self._device, "environment", (width, height, 1), gl.RGBA32F)
        picture.parameters(gl.LINEAR, gl.LINEAR, ("repeat", "clamp"))
        picture.upload(0, np.concatenate([pixels, np.ones_like(pixels[..., :1])], axis=-1))
        cube = CubeMap(self._device, "environment", face, gl.RGBA32F, levels=face.bit_length())
        cube.bind_image(0)
        self._project.set({}, {}, {"picture": picture})
        self._run(self._project, face)
        picture.release()
        cube.generate_mipmaps()
        return cube

    def _run(self, kernel: Kernel, face: int) -> None:
        groups = -(-face // _GROUP)
        kernel.run((groups, groups, 6))

    def release(self) -> None:
        """Free the kernels."""
        self._project.release()
        self._lobe.release()


def face_size(width: int) -> int:
    """Texels along an edge of a cube's face that shows a picture of this width as finely."""
    least, most = FACES
    return min(most, max(least, 1 << (max(1, width // 4) - 1).bit_length()))


def level_roughness(face: int) -> list[float]:
    """Roughness of each level: 0, then growing by √2 to 1, as lobes double with texels."""
    last = (face // LAST_FACE).bit_length() - 1
    return [0.0, *(2.0 ** (0.5 * (level - last)) for level in range(1, last + 1))]


def lobe_count(level: int) -> int:
    """Samples of a level's lobe: twice as many as at the level before, whose texels are four times
    as many."""
    return 1 if level == 0 else FEWEST_SAMPLES << (level - 1)


def lobe_samples(roughness: float, count: int, face: int) -> Float64:
    """What a lobe about +z reads: unit direction (times its share) and level of the source, [n, 4].

    Half vectors by GGX (Walter et al. 2007, equation 35) on a golden spiral, which has no streaks.
    A sample of density p stands for 1/(n·p) of the sphere and reads a level whose texels are four
    times as large, so that the samples' pattern does not show (Křivánek and Colbert 2008).
    """
    if roughness == 0.0:
        return np.array([[0.0, 0.0, 1.0, 0.0]])
    alpha_2 = roughness**4
    index = np.arange(count)
    u, phi = (index + 0.5) / count, GOLDEN_ANGLE_RAD * index
    cos_2 = (1.0 - u) / (1.0 + (alpha_2 - 1.0) * u)
    cos, sin = np.sqrt(cos_2), np.sqrt(1.0 - cos_2)
    along = 2.0 * cos * sin  # the mirrored eye, 2·cos·h − z
    light = np.stack([along * np.cos(phi), along * np.sin(phi), 2.0 * cos_2 - 1.0], axis=-1)
    density = alpha_2 / (np.pi * (cos_2 * (alpha_2 - 1.0) + 1.0) ** 2) / 4.0
    texel = 4.0 * np.pi / (6.0 * face * face)
    level = np.maximum(0.0, 0.5 * np.log2(1.0 / (count * density * texel)) + 1.0)
    above = light[:, 2] > 0.0
    light, level = light[above], level[above]
    # Directions carry their share n·l / Σ n·l in their length: sampling a cube ignores it.
    share = light[:, 2:] / light[:, 2].sum()
    return np.concatenate([light * share, level[:, None]], axis=-1)


def irradiance(pixels: NDArray[np.float32]) -> Float64:
    """Matrices M, [rgb, 4, 4]: irradiance/π of a normal n is (n, 1)ᵗ·M·(n, 1).

    The picture's spherical harmonics to order 2 under the cosine lobe, as the quadratic form of
    Ramamoorthi and Hanrahan 2001, equations 11 and 12: to that order the lobe max(0, c), c = n·l,
    is 1/4 + c/2 + 5/32·(3c² − 1), so the form's entries are moments ∫L·(l, 1)·(l, 1)ᵗ of the light.
    """
    light = _finer(pixels.astype(np.float64))
    rows, columns = light.shape[:2]
    edges = np.cos(np.arange(rows + 1) * np.pi / rows)
    solid_angle = (edges[:-1] - edges[1:]) * 2.0 * np.pi / columns
    theta = ((np.arange(rows) + 0.5) * np.pi / rows)[:, None]
    phi = (((np.arange(columns) + 0.5) / columns - 0.5) * 2.0 * np.pi)[None]
    x, y, z = np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)
    l = np.stack(np.broadcast_arrays(x, y, z, 1.0), axis=-1).reshape(-1, 4)  # noqa: E741 (its letter)
    arriving = (light * solid_angle[:, None, None]).reshape(-1, 3)
    moments = np.stack([(l * arriving[:, c, None]).T @ l for c in range(3)])
    lobe = np.full((4, 4), 15.0 / 32.0)
    lobe[3, :3] = lobe[:3, 3] = 1.0 / 4.0
    lobe[3, 3] = 1.0 / 4.0 - 5.0 / 32.0
    return np.asarray(lobe * moments / np.pi)


def _finer(pixels: Float64) -> Float64:
    """A picture of few rows interpolated to enough of them, as textures are."""
    factor = -(-FINEST_ROWS // len(pixels))
    if factor == 1:
        return pixels
    rows, columns = pixels.shape[:2]
    y = np.clip((np.arange(factor * rows) + 0.5) / factor - 0.5, 0.0, rows - 1.0)
    x = (np.arange(factor * columns) + 0.5) / factor - 0.5
    y0, x0 = np.floor(y).astype(int), np.floor(x).astype(int)
    fy, fx = (y - y0)[:, None, None], (x - x0)[None, :, None]
    across = pixels[:, x0 % columns] * (1.0 - fx) + pixels[:, (x0 + 1) % columns] * fx
    below = across[np.minimum(y0 + 1, rows - 1)]
    return np.asarray(across[y0] * (1.0 - fy) + below * fy)

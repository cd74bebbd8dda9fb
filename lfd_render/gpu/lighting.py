"""Light on the device: the scene's own lights, and the environment around it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lfd_render.gpu import raw as gl
from lfd_render.gpu.layout import CONSTANTS, dtype
from lfd_render.gpu.memory import Buffer, CubeMap
from lfd_render.scene import Light

if TYPE_CHECKING:
    from lfd_render.gpu.device import Device

_FARTHEST, _BRIGHTEST = 1e18, 1e38  # what float32 holds, squared and as it is
_NARROWEST = 1e-3  # least difference of a spot's cosines, as KHR_lights_punctual advises


@dataclass(frozen=True, eq=False)
class EnvironmentMap:
    """A picture ready to light a scene. radiance: blurred for rougher surfaces level by level, see
    shaders/common/environment.glsl; diffuse: float64 [rgb, 4, 4], irradiance/π of a normal n is
    (n, 1)ᵗ·M·(n, 1)."""

    radiance: CubeMap
    diffuse: NDArray[np.float64]

    def release(self) -> None:
        """Free the map."""
        self.radiance.release()


class Lighting:
    """The lights of a scene, which `place` writes each frame, and the environment in use.

    world_from_light: float64 [light, 4, 4]; may be set between frames.
    """

    def __init__(self, device: Device, lights: Sequence[Light]) -> None:
        self._lights = lights
        self.world_from_light = np.array([light.world_from_light for light in lights])
        self._power = np.array([np.array(light.color) * light.intensity for light in lights])
        self._range = np.array([light.range or np.inf for light in lights])
        self._records = np.zeros(max(1, len(lights)), dtype("Light"))
        for record, light in zip(self._records, lights, strict=False):
            record["fall"][:2] = cone_fall(light)
        self._light_block = Buffer.of(device, "lights", self._records)
        size = dtype("EnvironmentLight").itemsize
        self._environment_block = Buffer(device, "lights", size)
        self._none = CubeMap(device, "lights", 1, gl.RGBA16F)  # samplers must have something
        self.use("studio")

    def use(
        self,
        environment: str | EnvironmentMap,
        *,
        turn_rad: float = 0.0,
        intensity: float = 1.0,
    ) -> None:
        """Choose the environment, `studio`, `none` or a map, turned about +y, for kernels made from
        now on. A map stays the caller's to release."""
        self._environment = environment
        self._adjusted = turn_rad != 0.0 or intensity != 1.0
        record = np.zeros(1, dtype("EnvironmentLight"))
        levels = 1
        if isinstance(environment, EnvironmentMap):
            levels = environment.radiance.levels
            for channel, field in enumerate(("diffuse_red", "diffuse_green", "diffuse_blue")):
                record[field] = environment.diffuse[channel].reshape(16)  # symmetric
        record["turn"] = (np.cos(turn_rad), np.sin(turn_rad), intensity, levels - 1)
        self._environment_block.write(record)

    def place(self, display_from_world: NDArray[np.float64]) -> None:
        """Write the lights for a camera, float64 [4, 4].

        Shading has the world's directions, but places from the window's centre, because float32
        would lose them far from the world's origin, in a unit that keeps squares within float32
        (that of `Placement.turn_from_display`); candela are told for that unit too.
        """
        if not self._lights:
            return
        linear = display_from_world[:3, :3]
        size = np.abs(linear).max()
        back = np.linalg.inv(linear / size)
        unit = np.abs(back).max() / size  # of the world's
        window_world = -back @ (display_from_world[:3, 3] / size)
        axis = _unit(-self.world_from_light[:, :3, 2])
        located = np.array([light.kind != "directional" for light in self._lights])[:, None]
        with np.errstate(over="ignore", divide="ignore"):
            beside = (self.world_from_light[:, :3, 3] - window_world) / unit
            power = np.where(located, self._power / unit / unit, self._power)
            reach = unit / self._range
        place = np.where(located, np.clip(beside, -_FARTHEST, _FARTHEST), -axis)
        self._records["place"] = np.concatenate([place, located], axis=1)
        self._records["axis"][:, :3] = axis
        self._records["intensity"][:, :3] = np.minimum(power, _BRIGHTEST)
        self._records["fall"][:, 2] = np.minimum(reach, _FARTHEST)
        self._light_block.write(self._records)

    def constants(self) -> dict[str, int]:
        """Macros of the shaders that shade."""
        environment = CONSTANTS["PICTURE"]
        if not isinstance(self._environment, EnvironmentMap):
            environment = {"studio": CONSTANTS["STUDIO"], "none": 0}[self._environment]
        return {
            "LIGHTS": len(self._lights),
            "ENVIRONMENT": environment,
            "ADJUSTED": int(self._adjusted),
        }

    def buffers(self) -> dict[str, Buffer]:
        """Uniform blocks, by name."""
        return {"LightBlock": self._light_block, "EnvironmentBlock": self._environment_block}

    def samplers(self) -> dict[str, CubeMap]:
        """The environment's map, by sampler name."""
        environment = self._environment
        if isinstance(environment, EnvironmentMap):
            return {"environment_map": environment.radiance}
        return {"environment_map": self._none}

    def release(self) -> None:
        """Free everything but an environment's map."""
        for owner in (self._light_block, self._environment_block, self._none):
            owner.release()


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vectors [n, 3] at length 1; zero stays zero."""
    # Scaled first, so that lengths neither overflow nor vanish.
    scaled = vectors / np.maximum(np.abs(vectors).max(axis=1, keepdims=True), 1e-300)
    return np.asarray(scaled / np.maximum(np.linalg.norm(scaled, axis=1, keepdims=True), 1e-300))


def cone_fall(light: Light) -> tuple[float, float]:
    """Scale and offset by which the cosine from a spot's axis becomes its fall, before it is
    clamped to 0…1 and squared (KHR_lights_punctual, "Inner and outer cone angles")."""
    if light.kind != "spot":
        return 0.0, 1.0
    inner, outer = np.cos(light.inner_cone_rad), np.cos(light.outer_cone_rad)
    scale = 1.0 / max(_NARROWEST, float(inner - outer))
    return scale, float(-outer) * scale

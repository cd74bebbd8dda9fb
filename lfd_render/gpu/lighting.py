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

_FARTHEST = 1e18  # world units; its square is a float32
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
        self._records = _light_records(lights)
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

    def place(self, window_world: NDArray[np.float64]) -> None:
        """Write the lights for a camera. window_world: the window's centre, float64 [3].

        Places are told from there because float32 would lose them far from the world's origin.
        """
        if not self._lights:
            return
        # Scaled first, so that lengths neither overflow nor vanish.
        axis = -self.world_from_light[:, :3, 2]
        axis = axis / np.maximum(np.abs(axis).max(axis=1, keepdims=True), 1e-300)
        axis = axis / np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-300)
        distant = np.array([light.kind == "directional" for light in self._lights])[:, None]
        beside = np.clip(self.world_from_light[:, :3, 3] - window_world, -_FARTHEST, _FARTHEST)
        place = np.where(distant, -axis, beside)
        self._records["place"] = np.concatenate([place, ~distant], axis=1)
        self._records["axis"][:, :3] = axis
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


def _light_records(lights: Sequence[Light]) -> NDArray[np.void]:
    """What does not move; one record of darkness where there are none."""
    records = np.zeros(max(1, len(lights)), dtype("Light"))
    largest = float(np.finfo(np.float32).max)
    for record, light in zip(records, lights, strict=False):
        power = np.array(light.color) * light.intensity
        record["intensity"][:3] = np.minimum(power, largest)
        scale, offset = cone_fall(light)
        record["fall"] = (scale, offset, min(_FARTHEST, 1.0 / (light.range or np.inf)), 0.0)
    return records


def cone_fall(light: Light) -> tuple[float, float]:
    """Scale and offset by which the cosine from a spot's axis becomes its fall, before it is
    clamped to 0…1 and squared (KHR_lights_punctual, "Inner and outer cone angles")."""
    if light.kind != "spot":
        return 0.0, 1.0
    inner, outer = np.cos(light.inner_cone_rad), np.cos(light.outer_cone_rad)
    scale = 1.0 / max(_NARROWEST, float(inner - outer))
    return scale, float(-outer) * scale

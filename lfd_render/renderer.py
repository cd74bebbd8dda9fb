"""The renderer: one device, any scene, any display."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Camera, DisplayProfile, Rig, ViewGrid
from lfd_render.display.model import Spacing
from lfd_render.errors import ResourceError, SceneError, UsageError
from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.gpu.layout import LOD_RULES
from lfd_render.gpu.lighting import EnvironmentMap
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.panel.eia import Eia
from lfd_render.passes.encode import Encode
from lfd_render.passes.placement import Placement
from lfd_render.passes.prefilter import Prefilter
from lfd_render.passes.view_buffers import WINNERS
from lfd_render.passes.view_target import ViewTarget
from lfd_render.passes.weave import Weave
from lfd_render.scene import Environment, Scene
from lfd_render.techniques import Lfdpr, Mvr, Technique

REPEAT_TURN_RAD = np.deg2rad(0.5)  # how far the scene turns between repeated frames
TECHNIQUES = ("lfdpr", "mvr")
PRESETS = ("default", "paper")
PROJECTIONS = ("shear", "general")
ENVIRONMENTS = ("studio", "none")
MOST_VIEWS = 1024
MOST_RADIANCE = 65504.0  # what half floats hold
MOST_VIEW_PIXELS = 1 << 32  # of all views together: hours on a processor, and far above any panel


@dataclass(frozen=True)
class RenderOptions:
    """How to render. view_size: upright views of (width, height); None: views that follow the
    lenses, with as many rows as makes all views together as large as the panel. projection: how
    points reach the views, by the shear that parallel views share or by each view's own matrix.
    splat: how a pixel's nearest point is found, by 64-bit atomics, by two passes of 32-bit ones or
    by work groups that own their pixels, with the same picture; auto: what suits the device.
    environment: the built-in studio, none, or a picture, turned about the world's +y,
    counter-clockwise seen from above, and scaled.
    lod: how textures are filtered, one of LOD_RULES; None: as the preset has it (`lod_rule`)."""

    views: int | None = None
    view_size: tuple[int, int] | None = None
    technique: str = "lfdpr"
    preset: str = "default"
    spacing: Spacing | None = None
    seed: int = 0
    repeat: int = 1
    background: tuple[float, float, float] = (0.0, 0.0, 0.0)
    exposure: float = 1.0
    projection: str = "shear"
    splat: str = "auto"
    environment: str | Environment = "studio"
    environment_turn_rad: float = 0.0
    environment_intensity: float = 1.0
    lod: str | None = None

    def __post_init__(self) -> None:
        """Check ranges; raises UsageError."""
        for name, choice, choices in (
            ("technique", self.technique, TECHNIQUES),
            ("preset", self.preset, PRESETS),
            ("projection", self.projection, PROJECTIONS),
            ("lod", self.lod_rule, LOD_RULES),
        ):
            if choice not in choices:
                raise UsageError(f"{name} '{choice}': unknown; use {' or '.join(choices)}")
        if self.lod == "multiview" and self.technique == "mvr":
            others = " or ".join(rule for rule in LOD_RULES if rule != "multiview")
            raise UsageError(f"lod 'multiview': mvr has no points that views share; use {others}")
        self._check_splat()
        if self.views is not None and not _whole(self.views, MOST_VIEWS):
            raise UsageError(f"views: {self.views!r} is out of range; use 1 to {MOST_VIEWS}")
        size = self.view_size
        if size is not None and not (
            isinstance(size, tuple | list)
            and len(size) == 2
            and all(_whole(n, 16384) for n in size)
        ):
            raise UsageError(
                f"view size: {size!r} is out of range; use two whole numbers, 1 to 16384 a side"
            )
        if len(self.background) != 3 or not all(0 <= c <= MOST_RADIANCE for c in self.background):
            raise UsageError(
                f"background: {self.background}; use three numbers from 0 to {MOST_RADIANCE:g}"
            )
        if self.repeat < 1:
            raise UsageError(f"repeat: {self.repeat} is out of range; use 1 or more")
        if not 0.0 < self.exposure < np.inf:
            raise UsageError(f"exposure: {self.exposure} is out of range; use a positive number")
        if not isinstance(self.environment, Environment) and self.environment not in ENVIRONMENTS:
            raise UsageError(
                f"environment {self.environment!r}: unknown; use {', '.join(ENVIRONMENTS)} or "
                "an Environment"
            )
        if not np.isfinite(self.environment_turn_rad):
            raise UsageError(
                f"environment turn: {self.environment_turn_rad}; use a finite number of radians"
            )
        if not 0.0 <= self.environment_intensity <= MOST_RADIANCE:
            raise UsageError(
                f"environment intensity: {self.environment_intensity} is out of range; "
                f"use a number from 0 to {MOST_RADIANCE:g}"
            )

    @property
    def lod_rule(self) -> str:
        """The rule of LOD_RULES in use: the preset's where none is given. The paper filters LFDPR's
        textures by multiview mipmapping (section 3.3) and those of MVR as hardware does."""
        if self.lod is not None:
            return self.lod
        if self.preset == "paper":
            return "long-axis" if self.technique == "mvr" else "multiview"
        return "anisotropic"

    def _check_splat(self) -> None:
        if self.splat not in WINNERS:
            raise UsageError(f"splat '{self.splat}': unknown; use {', '.join(WINNERS)}")
        if self.splat == "owned" and self.projection == "general":
            raise UsageError(
                "splat 'owned': needs projection 'shear', whose views share their rows; "
                "with 'general' use auto"
            )
        if self.splat != "auto" and self.technique != "lfdpr":
            raise UsageError(
                f"splat '{self.splat}': technique '{self.technique}' does not splat; "
                "use it with lfdpr"
            )


def _whole(value: object, most: int) -> bool:
    return isinstance(value, int | np.integer) and 1 <= int(value) <= most


@dataclass
class _Timings:
    """Milliseconds of one call: what is done once, and each frame's stages and whole."""

    once: dict[str, float] = field(default_factory=dict)
    frames: list[tuple[float, dict[str, float]]] = field(default_factory=list)

    def measure(self, name: str, device: Device, work: Callable[[], Any]) -> Any:
        """Run something once, timed to an idle device."""
        start = time.perf_counter()
        result = work()
        device.finish()
        self.once[name] = self.once.get(name, 0.0) + 1000.0 * (time.perf_counter() - start)
        return result

    def summary(self) -> dict[str, float]:
        """The median frame's whole and stages beside what was done once, in ms."""
        order = sorted(self.frames, key=lambda frame: frame[0])
        stages = order[(len(order) - 1) // 2][1] if order else {}
        frame = {"frame": statistics.median(f[0] for f in order)} if order else {}
        return {key: round(ms, 3) for key, ms in {**self.once, **stages, **frame}.items()}


class Renderer:
    """Renders EIAs and views. It holds one GL context, which belongs to the thread that made it.

    device: ``auto``, ``gpu``, ``software``, an EGL index, or an open Device, which stays the
    caller's to close. Raises GpuError without OpenGL 4.5. The scene of the last call stays
    uploaded, so that rendering it again is quick.
    """

    def __init__(self, device: str | Device = "auto") -> None:
        if not isinstance(device, str | Device):
            raise UsageError(f"device: {device!r}; give 'auto', 'gpu', 'software', '0' or a Device")
        self._owns_device = isinstance(device, str)
        self.device = Device.open(device) if isinstance(device, str) else device
        self._scene: Scene | None = None
        self._buffers: SceneBuffers | None = None
        self._environment: Environment | None = None
        self._environment_map: EnvironmentMap | None = None

    def __enter__(self) -> Renderer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the scene and the context. Calling it again does nothing."""
        if self.device.closed:
            return
        self.device.activate()
        self._drop_scene()
        self._drop_environment()
        if self._owns_device:
            self.device.close()

    def render(
        self,
        scene: Scene,
        display: DisplayProfile,
        camera: Camera | None = None,
        views: int | None = None,
        **options: Any,
    ) -> Eia:
        """Render a scene into the panel image of a display.

        camera: where the display's window stands in the world; None uses the scene's own or frames
        it. views: number of views, the profile's by default. options: those of RenderOptions.
        Raises SceneError, UsageError, ResourceError or GpuError.
        """
        _check_kinds(scene, display, camera)
        choice = RenderOptions(views=views, **options)
        with self._call():
            return self._render(scene, display, camera or camera_for(scene, display), choice)

    def _render(
        self, scene: Scene, display: DisplayProfile, camera: Camera, choice: RenderOptions
    ) -> Eia:
        rig = display.rig(choice.views, choice.spacing)
        grid = _grid(display, choice, rig.views)
        _check_size(grid, rig.views)
        _check_in_front(scene, camera, rig)
        timings = _Timings()
        buffers = self._upload(scene, choice, timings)

        def compile_all() -> _PanelFrames:
            technique = self._technique(buffers, rig, grid, choice)
            frames = _PanelFrames(self.device, technique, display, choice.exposure)
            frames.warm_up(Placement(camera.display_from_world(rig.panel_mm), choice.background))
            return frames

        frames = timings.measure("compile", self.device, compile_all)
        for index in range(choice.repeat):
            turned = camera.turned((index - choice.repeat + 1) * float(REPEAT_TURN_RAD))
            matrix = turned.display_from_world(rig.panel_mm)
            timings.frames.append(frames.run(Placement(matrix, choice.background)))
        linear, pixels = timings.measure("read", self.device, frames.read)
        report = {
            "technique": choice.technique,
            "preset": choice.preset,
            "lod": choice.lod_rule,
            "views": rig.views,
            "view_size": [grid.columns, grid.rows],
            "view_grid": grid.kind,
            "triangles": scene.triangle_count,
            "points": frames.technique.count_points(),
            "splat": frames.technique.winners,
            "renderer": self.device.name,
            "device_bytes": self.device.ledger.peak,
            "warnings": list(buffers.warnings),
            "camera": camera.to_json_dict(),
            "timings_ms": timings.summary(),
        }
        self.device.check()
        frames.release()
        if choice.technique == "lfdpr" and report["points"] == 0:
            report["warnings"].append("nothing of the scene can be seen through the window")
        metadata = {
            "lfd:profile": display.name,
            "lfd:profile-hash": display.hash,
            "lfd:views": str(rig.views),
            "lfd:technique": choice.technique,
            "lfd:seed": str(choice.seed),
        }
        return Eia(pixels, linear, report, metadata)

    def views(
        self,
        scene: Scene,
        display: DisplayProfile,
        camera: Camera | None = None,
        views: int | None = None,
        rig: Rig | None = None,
        **options: Any,
    ) -> NDArray[np.uint8]:
        """Render single upright views, uint8 [view, y, x, 3], view 0 leftmost.

        rig: eyes other than the display's own, for example `Rig.single(display, angle)`. The view
        size is by default one column a lens and the default rows. Otherwise as `render`.
        """
        _check_kinds(scene, display, camera)
        choice = RenderOptions(views=views, **options)
        rig = rig or display.rig(choice.views, choice.spacing)
        with self._call():
            return self._views(scene, display, camera or camera_for(scene, display), rig, choice)

    def _views(
        self,
        scene: Scene,
        display: DisplayProfile,
        camera: Camera,
        rig: Rig,
        choice: RenderOptions,
    ) -> NDArray[np.uint8]:
        width, height = choice.view_size or upright_size(display, display.views)
        grid = ViewGrid.upright(display, width, height)
        _check_size(grid, rig.views)
        _check_in_front(scene, camera, rig)
        buffers = self._upload(scene, choice, _Timings())
        technique = self._technique(buffers, rig, grid, choice)
        encode = Encode(self.device, grid.columns, technique.target.images.height)
        pictures = np.empty((rig.views, grid.rows, grid.columns, 3), np.uint8)
        clock = StageClock(self.device)
        technique.begin(
            Placement(camera.display_from_world(display.size_mm), choice.background), clock
        )
        technique.warm_up(clock)  # which also makes room for the points of this very placement
        for band in technique.target.bands:
            technique.render(band, clock)
            for view in range(rig.views):
                encode(technique.target.images, view, choice.exposure)
                rows = slice(band.first, band.first + band.rows)
                pictures[view, rows] = encode.read()[: band.rows]
        self.device.check()
        technique.release()
        encode.release()
        return pictures

    @contextmanager
    def _call(self) -> Iterator[None]:
        """One rendering call: nothing of it stays on the device when it fails."""
        self.device.activate()
        self.device.ledger.restart_peak()
        try:
            with self.device.undoing():
                yield
        except BaseException:
            self._drop_scene()  # they may be among what was undone
            self._drop_environment()
            raise

    def _upload(self, scene: Scene, choice: RenderOptions, timings: _Timings) -> SceneBuffers:
        """The scene under its light; what is on the device already stays there."""
        if self._buffers is None or self._scene is not scene:
            self._drop_scene()
            self._buffers = timings.measure(
                "upload", self.device, lambda: SceneBuffers(self.device, scene)
            )
            self._scene = scene
        assert self._buffers is not None
        environment = choice.environment
        self._buffers.lighting.use(
            self._prefiltered(environment, timings)
            if isinstance(environment, Environment)
            else environment,
            turn_rad=choice.environment_turn_rad,
            intensity=choice.environment_intensity,
        )
        return self._buffers

    def _prefiltered(self, environment: Environment, timings: _Timings) -> EnvironmentMap:
        if self._environment_map is None or self._environment is not environment:
            self._drop_environment()
            prefilter = Prefilter(self.device)
            self._environment_map = timings.measure(
                "prefilter", self.device, lambda: prefilter(environment)
            )
            prefilter.release()
            self._environment = environment
        assert self._environment_map is not None
        return self._environment_map

    def _drop_scene(self) -> None:
        if self._buffers is not None:
            self._buffers.release()
            self._buffers = self._scene = None

    def _drop_environment(self) -> None:
        if self._environment_map is not None:
            self._environment_map.release()
            self._environment_map = self._environment = None

    def _technique(
        self, buffers: SceneBuffers, rig: Rig, grid: ViewGrid, choice: RenderOptions
    ) -> Technique:
        target = ViewTarget(self.device, rig, grid, buffers.batches, choice.seed)
        if choice.technique == "mvr":
            return Mvr(self.device, buffers, target, lod=choice.lod_rule)
        return Lfdpr(
            self.device,
            buffers,
            target,
            stochastic_culling=choice.preset == "paper",
            general=choice.projection == "general",
            winners=choice.splat,
            lod=choice.lod_rule,
        )


class _PanelFrames:
    """Frames of one technique, from camera to encoded panel image."""

    def __init__(
        self, device: Device, technique: Technique, display: DisplayProfile, exposure: float
    ) -> None:
        self.technique = technique
        self._device = device
        self._exposure = exposure
        target = technique.target
        self._weave = Weave(device, display, target.grid, target.rig.views)
        self._encode = Encode(device, *display.resolution_px)

    def warm_up(self, placement: Placement) -> None:
        """Run a little of everything: a software device compiles shaders when they first run."""
        clock = StageClock(self._device)
        self.technique.begin(placement, clock)
        self.technique.warm_up(clock)
        self._weave(self.technique.target.warm_up_band)
        self._encode(self._weave.panel, 0, self._exposure)

    def run(self, placement: Placement) -> tuple[float, dict[str, float]]:
        """One frame: its milliseconds, whole and by stage."""
        complete = False
        while not complete:
            clock = StageClock(self._device)
            self._device.finish()
            start = time.perf_counter()
            self.technique.begin(placement, clock)
            for band in self.technique.target.bands:
                self.technique.render(band, clock)
                with clock.stage("weave"):
                    self._weave(band)
            with clock.stage("encode_srgb"):
                self._encode(self._weave.panel, 0, self._exposure)
            self._device.finish()
            elapsed_ms = 1000.0 * (time.perf_counter() - start)
            complete = self.technique.complete()
        return elapsed_ms, clock.stages_ms

    def read(self) -> tuple[NDArray[np.float16], NDArray[np.uint8]]:
        """The last frame in linear light and encoded."""
        return self._weave.read_linear(), self._encode.read()

    def release(self) -> None:
        """Free everything, the technique included."""
        for owner in (self.technique, self._weave, self._encode):
            owner.release()


def camera_for(scene: Scene, display: DisplayProfile) -> Camera:
    """The scene's own window, or one that frames it in the display's comfortable depth."""
    if scene.default_camera is not None:
        return Camera.from_json_dict(dict(scene.default_camera), scene.name)
    return Camera.frame(*scene.bounds(), display)


def upright_size(display: DisplayProfile, views: int) -> tuple[int, int]:
    """Width and height of upright views: one column a lens, all views together as large as the
    panel."""
    rows = ViewGrid.default_rows(display, views)
    width, height = display.resolution_px
    return max(1, round(width * height / (views * rows))), rows


def _grid(display: DisplayProfile, choice: RenderOptions, views: int) -> ViewGrid:
    if choice.view_size is not None:
        return ViewGrid.upright(display, *choice.view_size)
    rows = ViewGrid.default_rows(display, views)
    if choice.preset == "paper":
        return ViewGrid.upright(display, *upright_size(display, views))
    return (ViewGrid.sheared if choice.technique == "mvr" else ViewGrid.lens)(display, rows)


def _check_kinds(scene: object, display: object, camera: object) -> None:
    """Raise UsageError for what is not an object of the right class, such as a file's name."""
    wanted = {
        "scene": (scene, Scene, "Scene"),
        "display": (display, DisplayProfile, "DisplayProfile"),
        "camera": (camera, Camera | None, "Camera"),
    }
    for argument, (value, kind, name) in wanted.items():
        if not isinstance(value, kind):
            raise UsageError(f"{argument}: {value!r}; give a {name}, as {name}.load(…) makes")


def _check_size(grid: ViewGrid, views: int) -> None:
    """Raise ResourceError for more view pixels than anyone waits for."""
    if views > MOST_VIEWS:
        raise UsageError(f"views: {views} is out of range; use 1 to {MOST_VIEWS}")
    pixels = views * grid.columns * grid.rows
    if pixels > MOST_VIEW_PIXELS:
        raise ResourceError(
            f"views: {views} of {grid.columns}×{grid.rows} are {pixels} pixels, more than "
            f"{MOST_VIEW_PIXELS}; use fewer or smaller views"
        )


def _check_in_front(scene: Scene, camera: Camera, rig: Rig) -> None:
    """Raise SceneError when nothing of the scene's box lies in front of the eyes."""
    low, high = scene.bounds()
    corners = np.array(
        [[(low, high)[i][0], (low, high)[j][1], (low, high)[k][2], 1.0]
         for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    )  # fmt: skip
    depths = rig.distance_mm - (corners @ camera.display_from_world(rig.panel_mm).T)[:, 2]
    if depths.max() <= rig.near_mm:
        raise SceneError(
            f"scene '{scene.name}': all of it lies behind the viewer; camera target "
            f"{list(camera.target)} with eye_direction {list(camera.eye_direction)} looks away, "
            "so turn eye_direction round or move the target"
        )

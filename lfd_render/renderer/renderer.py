"""Renders scenes for displays: uploads what is new, and runs a technique's frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from functools import partial
from types import TracebackType
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Camera, DisplayProfile, Rig, ViewGrid
from lfd_render.errors import ResourceError, SceneError, UsageError
from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.gpu.lighting import EnvironmentMap
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.panel.eia import Eia, eia_metadata
from lfd_render.panel.quilt import Quilt
from lfd_render.panel.stage import PanelOptions
from lfd_render.panel.unweave import Unwoven
from lfd_render.panel.weaving import check_views, weave_pictures
from lfd_render.passes.average import Average
from lfd_render.passes.encode import Encode
from lfd_render.passes.placement import Placement
from lfd_render.passes.prefilter import Prefilter
from lfd_render.passes.view_target import ViewTarget
from lfd_render.renderer.frames import PanelFrames, Timings
from lfd_render.renderer.options import RenderOptions
from lfd_render.renderer.plan import ViewPlan, plan_panel, plan_views, upright_size
from lfd_render.scene import Environment, Scene
from lfd_render.techniques import Lfdpr, Mvr, Technique

REPEAT_TURN_RAD = np.deg2rad(0.5)  # how far the scene turns between repeated frames
MOST_EYES = 2048
MOST_VIEW_PIXELS = 1 << 32  # of all views together: hours on a processor, and far above any panel


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
        views: int | Literal["continuous"] | None = None,
        *,
        progress: Callable[[float], None] | None = None,
        **options: Any,
    ) -> Eia:
        """Render a scene into the panel image of a display.

        camera: where the display's window stands in the world; None uses the scene's own or frames
        it. views: number of views, the profile's by default. progress: told the part of all frames
        that is done, 0 to 1. options: those of RenderOptions.
        Raises SceneError, UsageError, ResourceError or GpuError.
        """
        _check_kinds(scene, display, camera)
        choice = RenderOptions(views=views, **options)
        with self._call():
            window = camera or camera_for(scene, display)
            return self._render(scene, display, window, choice, progress or (lambda _: None))

    def _render(
        self,
        scene: Scene,
        display: DisplayProfile,
        camera: Camera,
        choice: RenderOptions,
        progress: Callable[[float], None],
    ) -> Eia:
        plan = plan_panel(display, choice)
        rig, grid = plan.rig, plan.grid
        _check_size(plan)
        _check_in_front(scene, camera, rig)
        timings = Timings()
        buffers = self._upload(scene, choice, timings)

        def compile_all() -> PanelFrames:
            technique = self._technique(buffers, plan, choice)
            panel = PanelOptions(
                plan.rule, plan.eyes, choice.exposure, choice.aa_light, choice.linear
            )
            frames = PanelFrames(self.device, technique, display, grid, panel)
            frames.warm_up(Placement(camera.display_from_world(rig.panel_mm), choice.background))
            return frames

        frames = timings.measure("compile", self.device, compile_all)
        for index in range(choice.repeat):
            turned = camera.turned((index - choice.repeat + 1) * float(REPEAT_TURN_RAD))
            matrix = turned.display_from_world(rig.panel_mm)
            placement = Placement(matrix, choice.background)
            done = partial(_part_done, progress, index, choice.repeat)
            timings.frames.append(frames.run(placement, done))
        linear, pixels = timings.measure("read", self.device, frames.read)
        report = {
            "technique": choice.technique,
            "preset": choice.preset,
            "lod": choice.lod_rule,
            "views": plan.views,
            "eyes": rig.views,
            "view_size": [grid.columns, grid.rows],
            "view_grid": grid.kind,
            "lookup": plan.rule.lookup,
            "weave": plan.rule.weave,
            "aa": plan.rule.aa,
            "supersample": list(choice.supersample),
            "triangles": scene.triangle_count,
            **_point_report(frames.technique, choice),
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
        metadata = eia_metadata(
            display,
            # As many as `look` takes rows for: where views are more than rows allow, the display's.
            plan.views if plan.rows_follow_views else display.views,
            grid,
            technique=choice.technique,
            preset=choice.preset,
            lod=choice.lod_rule,
            seed=choice.seed,
            exposure=choice.exposure,
            lookup=plan.rule.lookup,
            weave=plan.rule.weave,
            aa=plan.rule.aa,
            supersample="x".join(map(str, choice.supersample)),
        )
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
        if choice.views == "continuous":
            raise UsageError("views 'continuous': is for panel images; give a number")
        if rig is not None and choice.supersample[1] > 1:
            raise UsageError("supersample: eyes of your own cannot be multiplied; use 1 eye a view")
        size = choice.view_size or upright_size(display, display.views)
        plan = plan_views(display, choice, rig, size)
        with self._call():
            return self._views(scene, display, camera or camera_for(scene, display), plan, choice)

    def _views(
        self,
        scene: Scene,
        display: DisplayProfile,
        camera: Camera,
        plan: ViewPlan,
        choice: RenderOptions,
    ) -> NDArray[np.uint8]:
        grid = plan.grid
        _check_size(plan)
        _check_in_front(scene, camera, plan.rig)
        buffers = self._upload(scene, choice, Timings())
        technique = self._technique(buffers, plan, choice)
        target = technique.target
        average = Average(self.device, target, eyes=plan.eyes, times=plan.times)
        averaged = max(plan.eyes, plan.times) > 1
        encode = Encode(self.device, grid.columns, target.band_rows // plan.times)
        pictures = np.empty((plan.views, grid.rows, grid.columns, 3), np.uint8)
        clock = StageClock(self.device)
        technique.begin(
            Placement(camera.display_from_world(display.size_mm), choice.background), clock
        )
        technique.warm_up(clock)  # which also makes room for the points of this very placement
        for band in technique.target.bands:
            technique.render(band, clock)
            found = average(band) if averaged else band.view_images()
            rows = slice(*found.shown)
            for view in range(plan.views):
                encode(found.images, view, choice.exposure)
                pictures[view, rows] = encode.read()[: rows.stop - rows.start]
        self.device.check()
        for owner in (technique, encode, average):
            owner.release()
        return pictures

    def weave(
        self,
        views: NDArray[np.uint8] | Quilt | Unwoven,
        display: DisplayProfile,
        grid: ViewGrid | None = None,
    ) -> Eia:
        """Weave pictures of views into the panel image of a display: a quilt, unwoven views, or
        uint8 [view, y, x, 3] in sRGB, view 0 leftmost, upright unless `grid` says otherwise.

        Between columns of upright views light is mixed; views that follow the lenses keep their
        very codes. Raises UsageError for arrays that are no views, ResourceError or GpuError.
        """
        if not isinstance(display, DisplayProfile):
            raise UsageError(f"display: {display!r}; give a DisplayProfile, as its load(…) makes")
        if isinstance(views, Unwoven):
            grid = views.grid
        pictures = views if isinstance(views, np.ndarray) else views.views
        if pictures.ndim != 4:
            raise UsageError(f"views: shape {list(pictures.shape)}; give uint8 [view, y, x, 3]")
        grid = grid or ViewGrid.upright(display, pictures.shape[2], pictures.shape[1])
        check_views(pictures, grid)
        count = len(pictures)
        timings = Timings()
        with self._call():
            pixels, linear = timings.measure(
                "weave",
                self.device,
                lambda: weave_pictures(self.device, pictures, display, grid),
            )
        report = {
            "views": count,
            "view_size": [grid.columns, grid.rows],
            "view_grid": grid.kind,
            "renderer": self.device.name,
            "device_bytes": self.device.ledger.peak,
            "warnings": [],
            "timings_ms": timings.summary(),
        }
        return Eia(pixels, linear, report, eia_metadata(display, count, grid, technique="weave"))

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

    def _upload(self, scene: Scene, choice: RenderOptions, timings: Timings) -> SceneBuffers:
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

    def _prefiltered(self, environment: Environment, timings: Timings) -> EnvironmentMap:
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

    def _technique(self, buffers: SceneBuffers, plan: ViewPlan, choice: RenderOptions) -> Technique:
        target = ViewTarget(
            self.device,
            plan.rig,
            plan.rendered,
            buffers.batches,
            choice.seed,
            row_step=plan.times,
            halo=plan.halo,
        )
        if choice.technique == "mvr":
            return Mvr(self.device, buffers, target, lod=choice.lod_rule)
        return Lfdpr(
            self.device,
            buffers,
            target,
            sampling=choice.sampling,
            general=choice.projection == "general",
            winners=choice.splat,
            lod=choice.lod_rule,
        )


def _point_report(technique: Technique, choice: RenderOptions) -> dict[str, Any]:
    """What the report says of points: how they were made, how many, and what they took."""
    if choice.technique != "lfdpr":
        return {"points": 0, "splat": None}
    sampling = asdict(choice.sampling)
    report = {"point_source": sampling.pop("source"), **sampling, "splat": technique.winners}
    if not choice.effort:
        return {"points": technique.count_points(), **report}
    effort = technique.effort()
    per_pixel = effort.pairs_tried / max(effort.visible_pixels, 1)
    return {**asdict(effort), "pairs_per_visible_pixel": round(per_pixel, 3), **report}


def camera_for(scene: Scene, display: DisplayProfile) -> Camera:
    """The scene's own window, or one that frames it in the display's comfortable depth."""
    if scene.default_camera is not None:
        return Camera.from_json_dict(dict(scene.default_camera), scene.name)
    return Camera.frame(*scene.bounds(), display)


def _part_done(progress: Callable[[float], None], frame: int, frames: int, part: float) -> None:
    progress((frame + part) / frames)


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


def _check_size(plan: ViewPlan) -> None:
    """Raise ResourceError for more view pixels than anyone waits for."""
    eyes, grid = plan.rig.views, plan.rendered
    if eyes > MOST_EYES:
        raise UsageError(f"views: {eyes} eyes are too many; use at most {MOST_EYES}")
    pixels = eyes * grid.columns * grid.rows
    if pixels > MOST_VIEW_PIXELS:
        raise ResourceError(
            f"views: {eyes} of {grid.columns}×{grid.rows} are {pixels} pixels, more than "
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

"""Renders scenes for displays: uploads what is new, and stages it for a technique's frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from types import TracebackType
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import (
    Camera,
    DisplayProfile,
    Reconstruction,
    Rig,
    ViewGrid,
    seen_from_height,
)
from lfd_render.errors import CancelledError, ResourceError, SceneError, UsageError
from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.gpu.lighting import EnvironmentMap
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.panel.eia import Eia, eia_metadata
from lfd_render.panel.quilt import Quilt
from lfd_render.panel.stage import LIGHTS, PanelOptions, codes_alone
from lfd_render.panel.unweave import Unwoven
from lfd_render.panel.weaving import check_views, weave_pictures
from lfd_render.passes.average import Average
from lfd_render.passes.encode import Encode
from lfd_render.passes.placement import Placement
from lfd_render.passes.prefilter import Prefilter
from lfd_render.passes.view_target import ViewTarget
from lfd_render.renderer.frames import PanelFrames, Progress, Timings
from lfd_render.renderer.options import RenderOptions, choose
from lfd_render.renderer.plan import ViewPlan, plan_panel, plan_views, upright_size
from lfd_render.renderer.stage import REPEAT_TURN_RAD, Stage, check_frame, check_in_front
from lfd_render.scene import Environment, Pose, Scene
from lfd_render.techniques import Lfdpr, Technique, make_mvr
from lfd_render.techniques.mvr import is_deferred

MOST_EYES = 2048
MOST_VIEW_PIXELS = 1 << 32  # of all views together: hours on a processor, and far above any panel


class Renderer:
    """Renders EIAs and views. It holds one GL context, which belongs to the thread that made it.

    device: ``auto``, ``gpu``, ``software``, an EGL index, or an open Device, which stays the
    caller's to close. Raises GpuError without OpenGL 4.5. The scene of the last call stays
    uploaded, and staged if it was `render`, so that rendering it again is quick.
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
        self._stage: Stage | None = None

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
        self._end_stage()
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
        pose: Pose | None = None,
        progress: Progress | None = None,
        **options: Any,
    ) -> Eia:
        """Render a scene into the panel image of a display.

        camera: where the display's window stands in the world; None uses the scene's own or frames
        it. views: number of views, the profile's by default. pose: how the scene's nodes stand, by
        default at rest. progress: told the part of all frames that is done, 0 to 1. options: those
        of RenderOptions. What the call needed stays ready as a `Stage` for a next call with the
        same scene, display and options.
        Raises SceneError, UsageError, ResourceError or GpuError.
        """
        _check_kinds(scene, display, camera, pose)
        choice = choose(views, options)
        camera = camera or camera_for(scene, display)
        self._end_other_stage(scene, display, choice)
        with self._call():
            stage = self._staged(scene, display, camera, choice, pose)
            for index in range(choice.repeat):
                turn = (index - choice.repeat + 1) * float(REPEAT_TURN_RAD)
                done = partial(_part_done, progress or _ignored, index, choice.repeat)
                stage.run(camera.turned(turn), pose, choice, done)
            return stage.result(choice)

    def stage(
        self,
        scene: Scene,
        display: DisplayProfile,
        camera: Camera | None = None,
        views: int | Literal["continuous"] | None = None,
        **options: Any,
    ) -> Stage:
        """A scene before a display with everything compiled and allocated, for many frames.

        camera: what frames take that are given none. Otherwise as `render`. Asked again for the
        same scene, display and options but exposure and background, it gives the same stage, with
        the new ones; asked for others it ends the one before.
        """
        _check_kinds(scene, display, camera)
        choice = choose(views, options)
        self._end_other_stage(scene, display, choice)
        with self._call():
            stage = self._staged(scene, display, camera or camera_for(scene, display), choice)
        stage.choice = choice
        stage.camera = camera or camera_for(scene, display)
        return stage

    def _staged(
        self,
        scene: Scene,
        display: DisplayProfile,
        camera: Camera,
        choice: RenderOptions,
        pose: Pose | None = None,
    ) -> Stage:
        """The stage for these, which may be there already, warmed up by this camera and pose."""
        if self._stage is not None:
            return self._stage
        plan = plan_panel(display, choice)
        _check_size(plan)
        if pose is None:
            check_in_front(scene, camera, plan.rig)
        timings = Timings()
        buffers = self._upload(scene, choice, timings)
        buffers.pose(pose)

        def compile_all() -> PanelFrames:
            panel = PanelOptions(plan.rule, plan.eyes, choice.aa_light, choice.linear)
            codes = codes_alone(panel, plan.grid, times=plan.times)
            technique = self._technique(buffers, plan, choice, codes=codes)
            frames = PanelFrames(self.device, technique, display, plan.grid, panel)
            matrix = camera.display_from_world(plan.rig.panel_mm)
            frames.warm_up(Placement(matrix, choice.background, choice.exposure))
            return frames

        frames = timings.measure("compile", self.device, compile_all)
        self._stage = Stage(
            self.device, scene, display, choice, plan,
            camera=camera, buffers=buffers, frames=frames, timings=timings, call=self._call,
        )  # fmt: skip
        return self._stage

    def _end_other_stage(
        self, scene: Scene, display: DisplayProfile, choice: RenderOptions
    ) -> None:
        """End the stage there is unless it serves these."""
        if self._stage is not None and not self._stage.serves(scene, display, choice):
            self._end_stage()

    def _end_stage(self) -> None:
        if self._stage is not None:
            self._stage.close()
            self._stage = None

    def views(
        self,
        scene: Scene,
        display: DisplayProfile,
        camera: Camera | None = None,
        views: int | None = None,
        rig: Rig | None = None,
        *,
        heights_mm: Sequence[float] | None = None,
        pose: Pose | None = None,
        progress: Progress | None = None,
        **options: Any,
    ) -> NDArray[np.uint8]:
        """Render single upright views, uint8 [view, y, x, 3], view 0 leftmost.

        rig: eyes other than the display's own, for example `Rig.single(display, angle)`.
        heights_mm: of such lines of eyes above the panel's centre, for arrays of cameras; the
        pictures are then [height, view, y, x, 3]. The view size is by default one column a lens
        and the default rows. Otherwise as `render`.
        """
        _check_kinds(scene, display, camera, pose)
        choice = choose(views, options)
        if choice.views == "continuous":
            raise UsageError("views 'continuous': is for panel images; give a number")
        if rig is not None and choice.supersample[1] > 1:
            raise UsageError("supersample: eyes of your own cannot be multiplied; use 1 eye a view")
        size = choice.view_size or upright_size(display, display.views)
        plan = plan_views(display, choice, rig, size)
        camera = camera or camera_for(scene, display)
        heights = (0.0,) if heights_mm is None else _heights(heights_mm)
        shears = [seen_from_height(height, display.distance_mm) for height in heights]
        self._end_stage()
        with self._call():
            pictures = self._views(
                scene, display, camera, plan, choice,
                shears=shears, pose=pose, progress=progress or _ignored,
            )  # fmt: skip
        return pictures[0] if heights_mm is None else pictures

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is to be said of the scene rendered last, and of what the device could not hold."""
        return tuple(self._buffers.warnings) if self._buffers else ()

    def _views(
        self,
        scene: Scene,
        display: DisplayProfile,
        camera: Camera,
        plan: ViewPlan,
        choice: RenderOptions,
        *,
        shears: list[NDArray[np.float64]],
        pose: Pose | None,
        progress: Progress,
    ) -> NDArray[np.uint8]:
        """Of each line of eyes, [line, view, y, x, 3]; shears: what takes display space to them."""
        grid = plan.grid
        _check_size(plan, lines=len(shears))
        if pose is None:
            check_in_front(scene, camera, plan.rig)
        buffers = self._upload(scene, choice, Timings())
        buffers.pose(pose)
        technique = self._technique(buffers, plan, choice)
        target = technique.target
        average = Average(self.device, target, eyes=plan.eyes, times=plan.times)
        averaged = max(plan.eyes, plan.times) > 1
        encode = Encode(self.device, grid.columns, target.band_rows // plan.times)
        pictures = np.empty((len(shears), plan.views, grid.rows, grid.columns, 3), np.uint8)
        clock = StageClock(self.device)
        display_from_world = camera.display_from_world(display.size_mm)
        for line, shear in enumerate(shears):
            technique.begin(Placement(shear @ display_from_world, choice.background), clock)
            if line == 0:
                technique.warm_up(clock)
            complete = False
            while not complete:
                for index, band in enumerate(target.bands):
                    progress((line + index / len(target.bands)) / len(shears))
                    technique.render(band, clock)
                    found = average(band) if averaged else band.view_images()
                    rows = slice(*found.shown)
                    for view in range(plan.views):
                        encode(found.images, view, choice.exposure)
                        pictures[line, view, rows] = encode.read()[: rows.stop - rows.start]
                complete = technique.complete()
        self.device.check()
        for owner in (technique, encode, average):
            owner.release()
        return pictures

    def weave(
        self,
        views: NDArray[np.uint8] | Quilt | Unwoven,
        display: DisplayProfile,
        grid: ViewGrid | None = None,
        *,
        lookup: str = "lens",
        weave: str = "nearest",
        aa: str = "none",
        aa_light: str = "linear",
    ) -> Eia:
        """Weave pictures of views into the panel image of a display: a quilt, unwoven views, or
        uint8 [view, y, x, 3] in sRGB, view 0 leftmost, upright unless `grid` says otherwise.

        lookup, weave, aa, aa_light: as in RenderOptions. By default light is mixed between columns
        of upright views, and views that follow the lenses keep their very codes. Raises UsageError
        for arrays that are no views and unknown choices, ResourceError or GpuError.
        """
        rule = Reconstruction(lookup, weave, aa)
        if aa_light not in LIGHTS:
            raise UsageError(f"aa light '{aa_light}': unknown; use {' or '.join(LIGHTS)}")
        if not isinstance(display, DisplayProfile):
            raise UsageError(f"display: {display!r}; give a DisplayProfile, as its load(…) makes")
        if not isinstance(views, np.ndarray | Quilt | Unwoven):
            raise UsageError(f"views: {type(views).__name__}; give a Quilt, Unwoven or an array")
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
                lambda: weave_pictures(
                    self.device, pictures, display, grid, rule=rule, light=aa_light
                ),
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
        metadata = eia_metadata(
            display,
            count,
            grid,
            technique="weave",
            lookup=lookup,
            weave=weave,
            aa=aa,
            aa_light=aa_light,
        )
        return Eia(pixels, linear, report, metadata, display.panel.mount)

    @contextmanager
    def _call(self) -> Iterator[None]:
        """One rendering call: nothing of it stays on the device when it fails."""
        self.device.activate()
        self.device.ledger.restart_peak()
        before = self._standing()
        try:
            with self.device.undoing():
                yield
        except BaseException as error:
            # What a bad scene, pose or camera, or one who leaves, finds standing stands, unless
            # something was replaced.
            harmless = isinstance(error, SceneError | UsageError | CancelledError)
            if not (harmless and self._standing() == before):
                self._end_stage()  # they may be among what was undone
                self._drop_scene()
                self._drop_environment()
            raise

    def _standing(self) -> tuple[object, ...]:
        """What is on the device, and what this renderer takes to be there."""
        return set(self.device.owned), self._buffers, self._environment_map, self._stage

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

    def _technique(
        self, buffers: SceneBuffers, plan: ViewPlan, choice: RenderOptions, *, codes: bool = False
    ) -> Technique:
        """codes: whether nothing is asked of views but codes, which what shades them may store
        where it neither rasterises nor blends."""
        shades = choice.technique != "mvr" or is_deferred(choice.mvr)
        blends = any(batch.alpha_mode == "blend" for batch in buffers.batches)
        target = ViewTarget(
            self.device,
            plan.rig,
            plan.rendered,
            buffers.batches,
            choice.seed,
            row_step=plan.times,
            halo=plan.halo,
            encoded=codes and shades and not blends,
        )
        if choice.technique == "mvr":
            return make_mvr(self.device, buffers, target, variant=choice.mvr, lod=choice.lod_rule)
        return Lfdpr(
            self.device,
            buffers,
            target,
            sampling=choice.sampling,
            general=choice.projection == "general",
            winners=choice.splat,
            lod=choice.lod_rule,
        )


def camera_for(scene: Scene, display: DisplayProfile) -> Camera:
    """The scene's own window, or one that frames it in the display's comfortable depth."""
    if scene.default_camera is not None:
        return Camera.from_json_dict(dict(scene.default_camera), scene.name)
    return Camera.frame(*scene.bounds(), display)


def _ignored(part: float) -> None:
    """Progress that nobody watches."""


def _part_done(progress: Progress, frame: int, frames: int, part: float) -> None:
    progress((frame + part) / frames)


def _check_kinds(scene: object, display: object, camera: object, pose: object = None) -> None:
    """Raise UsageError for what is not an object of the right class, such as a file's name."""
    wanted = {
        "scene": (scene, Scene, "Scene"),
        "display": (display, DisplayProfile, "DisplayProfile"),
    }
    for argument, (value, kind, name) in wanted.items():
        if not isinstance(value, kind):
            raise UsageError(f"{argument}: {value!r}; give a {name}, as {name}.load(…) makes")
    check_frame(camera, pose)


def _heights(heights_mm: Sequence[float]) -> tuple[float, ...]:
    """Heights as floats; raises UsageError for what is none."""
    try:
        heights = tuple(map(float, heights_mm))
    except (TypeError, ValueError):
        heights = ()
    if not heights:
        raise UsageError(f"heights: {heights_mm!r}; give numbers of mm, one for each line of eyes")
    return heights


def _check_size(plan: ViewPlan, lines: int = 1) -> None:
    """Raise ResourceError for more view pixels than anyone waits for."""
    eyes, grid = plan.rig.views, plan.rendered
    if eyes > MOST_EYES:
        raise UsageError(f"views: {eyes} eyes are too many; use at most {MOST_EYES}")
    pixels = lines * eyes * grid.columns * grid.rows
    if pixels > MOST_VIEW_PIXELS:
        raise ResourceError(
            f"views: {eyes} of {grid.columns}×{grid.rows} are {pixels} pixels, more than "
            f"{MOST_VIEW_PIXELS}; use fewer or smaller views"
        )

"""A scene staged before a display: what its frames need, kept from one to the next."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import asdict, replace
from types import TracebackType
from typing import Any

import numpy as np

from lfd_render.display import Camera, DisplayProfile, Rig
from lfd_render.errors import SceneError, UsageError
from lfd_render.gpu.device import Device
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.panel.eia import Eia, eia_metadata
from lfd_render.passes.placement import Placement
from lfd_render.renderer.frames import PanelFrames, Progress, Timings
from lfd_render.renderer.options import RenderOptions
from lfd_render.renderer.plan import ViewPlan
from lfd_render.scene import Pose, Scene
from lfd_render.techniques import Technique

REPEAT_TURN_RAD = np.deg2rad(0.5)  # how far the scene turns between repeated frames


class Stage:
    """A scene before a display, ready for frame after frame of any camera and pose.

    `Renderer.stage` makes it, with one warm-up. From then on nothing is compiled and nothing made
    on the device: a frame writes matrices and weights and runs. Only a frame of more points than
    any before makes their buffers larger. Frames depend on scene, display, options, camera and
    pose alone, to the bit, not on the frames before.

    A renderer has one stage. It ends, and its memory is freed, when it is closed, when the renderer
    is closed or asked for views, or for another scene, display or options than those; then it
    raises UsageError. A bad pose or camera raises SceneError and leaves it usable; any other error
    ends it.
    """

    def __init__(
        self,
        device: Device,
        scene: Scene,
        display: DisplayProfile,
        choice: RenderOptions,
        plan: ViewPlan,
        *,
        camera: Camera,
        buffers: SceneBuffers,
        frames: PanelFrames,
        timings: Timings,
        call: Callable[[], AbstractContextManager[None]],
    ) -> None:
        """call: what surrounds each use of the device. The stage owns `frames`, not `buffers`."""
        self.scene, self.display, self.choice = scene, display, choice
        self._plan = plan
        self.camera = self._last_camera = camera
        self.closed = False
        self._device = device
        self._buffers = buffers
        self._frames = frames
        self._call = call
        self._timings = timings

    def __enter__(self) -> Stage:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def render(self, camera: Camera | None = None, pose: Pose | None = None) -> Eia:
        """A frame as a panel image. camera: by default the one that the stage was made with; pose:
        by default at rest. Raises SceneError, ResourceError, UsageError or GpuError."""
        self.frame(camera, pose)
        return self.read()

    def frame(self, camera: Camera | None = None, pose: Pose | None = None) -> float:
        """Render a frame that stays on the device; its milliseconds. Otherwise as `render`."""
        self._check_open()
        check_frame(camera, pose)
        with self._call():
            return self.run(camera or self.camera, pose, self.choice, lambda _: None)

    def read(self) -> Eia:
        """The panel image of the last frame, with the timings of the frames since the last one."""
        self._check_open()
        with self._call():
            return self.result(self.choice)

    def close(self) -> None:
        """Free what frames need; the scene stays uploaded. Calling it again does nothing."""
        if self.closed:
            return
        if not self._device.closed:
            self._device.activate()
            self._frames.release()
        self.closed = True

    def serves(self, scene: Scene, display: DisplayProfile, choice: RenderOptions) -> bool:
        """Whether a frame of these can be rendered here; exposure and background may differ."""
        return (
            not self.closed
            and self.scene is scene
            and self.display == display
            and _fixed(self.choice) == _fixed(choice)
        )

    def run(
        self, camera: Camera, pose: Pose | None, choice: RenderOptions, progress: Progress
    ) -> float:
        """One frame, inside a call of the renderer, of options that the stage serves."""
        rig = self._plan.rig
        if pose is None:
            check_in_front(self.scene, camera, rig)
        self._buffers.pose(pose)
        matrix = camera.display_from_world(rig.panel_mm)
        placement = Placement(matrix, choice.background, choice.exposure)
        frame = self._frames.run(placement, progress)
        self._timings.frames.append(frame)
        self._last_camera = camera
        return frame[0]

    def result(self, choice: RenderOptions) -> Eia:
        """The last frame's image and report, inside a call of the renderer."""
        if not self._timings.frames:
            raise UsageError("stage: no frame since the last read; render one first")
        timings, technique = self._timings, self._frames.technique
        linear, pixels = timings.measure("read", self._device, self._frames.read)
        plan, grid = self._plan, self._plan.grid
        points = _point_report(technique, choice)
        warnings = list(self._buffers.warnings)
        if choice.technique != "mvr" and points["points"] == 0:
            warnings.append("nothing of the scene can be seen through the window")
        report = {
            "technique": choice.technique,
            "mvr": choice.mvr if choice.technique == "mvr" else None,
            "preset": choice.preset,
            "lod": choice.lod_rule,
            "views": plan.views,
            "eyes": plan.rig.views,
            "view_size": [grid.columns, grid.rows],
            "view_grid": grid.kind,
            "lookup": plan.rule.lookup,
            "weave": plan.rule.weave,
            "aa": plan.rule.aa,
            "supersample": list(choice.supersample),
            "triangles": self.scene.triangle_count,
            **points,
            "renderer": self._device.name,
            "device_bytes": self._device.ledger.peak,
            "warnings": warnings,
            "camera": self._last_camera.to_json_dict(),
            "timings_ms": timings.summary(),
        }
        self._timings = Timings()
        self._device.check()
        metadata = eia_metadata(
            self.display,
            plan.views,
            grid,
            # What an eye's rows go by: where views are more than rows allow, the display's.
            eye_views=plan.views if plan.rows_follow_views else self.display.views,
            technique=choice.technique,
            preset=choice.preset,
            lod=choice.lod_rule,
            seed=choice.seed,
            exposure=choice.exposure,
            lookup=plan.rule.lookup,
            weave=plan.rule.weave,
            aa=plan.rule.aa,
            aa_light=choice.aa_light,
            supersample="x".join(map(str, choice.supersample)),
            **_sampling(technique, choice),
        )
        return Eia(pixels, linear, report, metadata, self.display.panel.mount)

    def _check_open(self) -> None:
        if self.closed:
            raise UsageError(
                "stage: it has ended, closed or followed by another call of its renderer; "
                "make a new one with Renderer.stage"
            )


def _fixed(choice: RenderOptions) -> RenderOptions:
    """Options without those that each frame may choose."""
    return replace(
        choice, repeat=1, exposure=1.0, background=(0.0, 0.0, 0.0), effort=False, counted=True
    )


def _sampling(technique: Technique, choice: RenderOptions) -> dict[str, Any]:
    """How points were made and shaded; of exact, which has slices alone, how they were shaded."""
    sampling = asdict(technique.sampling) if technique.sampling else {}
    return {"shade": sampling["shade"]} if choice.technique == "exact" else sampling


def _point_report(technique: Technique, choice: RenderOptions) -> dict[str, Any]:
    """What the report says of points: how they were made, how many, and what they took."""
    if technique.sampling is None:
        return {"points": 0, "splat": None}
    sampling = _sampling(technique, choice)
    source = {"point_source": sampling.pop("source")} if "source" in sampling else {}
    report = {**source, **sampling, "splat": technique.winners}
    if not choice.effort:
        return {"points": technique.count_points() if choice.counted else None, **report}
    effort = technique.effort()
    per_pixel = effort.pairs_tried / max(effort.visible_pixels, 1)
    return {**asdict(effort), "pairs_per_visible_pixel": round(per_pixel, 3), **report}


def check_frame(camera: object, pose: object) -> None:
    """Raise UsageError for what is not an object of the right class, such as a file's name."""
    if not isinstance(camera, Camera | None):
        raise UsageError(f"camera: {camera!r}; give a Camera, as Camera.load(…) makes")
    if not isinstance(pose, Pose | None):
        raise UsageError(f"pose: {pose!r}; give a Pose")


def check_in_front(scene: Scene, camera: Camera, rig: Rig) -> None:
    """Raise SceneError when nothing of the scene's box at rest lies in front of the eyes."""
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

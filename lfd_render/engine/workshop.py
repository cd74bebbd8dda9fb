"""Makes what jobs ask for, on one renderer, and keeps what the next job may need."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import DisplayProfile, Rig
from lfd_render.display.mount import stored
from lfd_render.engine import encoding
from lfd_render.engine.digests import scene_digest
from lfd_render.engine.jobs import (
    AllViews,
    Holds,
    Job,
    OneView,
    PanelImage,
    Pattern,
    QuiltPicture,
    Result,
    SceneFacts,
    Seen,
    ViewMap,
)
from lfd_render.engine.lru import ByteLru
from lfd_render.engine.patterns import pattern_picture
from lfd_render.engine.quilts import chosen_size
from lfd_render.errors import OptionError, UsageError
from lfd_render.panel.eia import Eia
from lfd_render.panel.eyes import stands
from lfd_render.panel.look import look_from
from lfd_render.panel.picture import side_by_side
from lfd_render.panel.quilt import Quilt
from lfd_render.panel.quilt_names import comment_exif, stored_text
from lfd_render.renderer import Renderer, upright_size
from lfd_render.scene import Scene
from lfd_render.scene.exposure import exposure_hint

Progress = Callable[[float], None]


class Workshop:
    """One renderer with the scenes and panel images that it made last, so many bytes of each.

    A panel image that is looked at from another place, or asked for in another encoding, is not
    rendered again. Where only the camera differs the renderer's stage goes on; where only the
    display does, the scene stays uploaded but its points are made anew, since they lie on the rows
    and at the density that a display's views ask for.
    """

    def __init__(self, renderer: Renderer, scene_bytes: int, frame_bytes: int) -> None:
        self._renderer = renderer
        self._scenes: ByteLru[Scene] = ByteLru(scene_bytes)
        self._frames: ByteLru[Eia] = ByteLru(frame_bytes)
        self._scene_of: dict[str, str] = {}  # of each frame key
        self._staged: str | None = None

    def holds(self) -> Holds:
        """What is at hand."""
        return Holds(frozenset(self._scenes), frozenset(self._frames), self._staged)

    def forget(self, scene: str) -> None:
        """Drop a scene and all panel images of it."""
        self._scenes.drop(scene)
        for key in [key for key, of in self._scene_of.items() if of == scene]:
            self._frames.drop(key)
            del self._scene_of[key]

    def make(self, job: Job, progress: Progress) -> Result:
        """The job's result. Raises the errors of what it takes; whatever `progress` raises calls
        it off."""
        spans = Spans()
        match job.product:
            case PanelImage():
                result = self._panel_image(job, progress, spans)
            case Seen():
                result = self._seen(job, job.product, progress, spans)
            case OneView():
                result = self._one_view(job, job.product, progress, spans)
            case AllViews():
                result = self._all_views(job, progress, spans)
            case QuiltPicture():
                result = self._quilt(job, job.product, progress, spans)
            case SceneFacts():
                result = self._facts(job, job.product, spans)
            case ViewMap():
                result = _view_map(job, spans)
            case Pattern():
                result = _pattern(job, job.product, spans)
        return result

    def _scene(self, job: Job, spans: Spans) -> Scene:
        source = job.scene
        assert source is not None
        scene = self._scenes.get(source.id)
        if scene is None:
            with spans.span("load"):
                scene = Scene.load(source.path, source.limits)
                self._scenes.put(source.id, scene, scene_bytes(scene))
        return scene

    def _eia(self, job: Job, progress: Progress, spans: Spans) -> Eia:
        eia = self._frames.get(job.frame_key)
        if eia is not None:
            return eia
        scene, display = self._scene(job, spans), _display(job)
        choices = job.choices
        self._staged = None
        eia = self._renderer.render(
            scene,
            display,
            choices.window(scene, display),
            progress=progress,
            linear=job.media == encoding.EXR,
            counted=False,
            **choices.options(),
        )
        self._staged = job.stage_key
        spans.add(eia.report["timings_ms"])
        weight = eia.pixels.nbytes + (0 if eia.linear is None else eia.linear.nbytes)
        self._frames.put(job.frame_key, eia, weight)
        self._remember(job)
        return eia

    def _remember(self, job: Job) -> None:
        assert job.scene is not None
        self._scene_of[job.frame_key] = job.scene.id
        kept = set(self._frames)
        self._scene_of = {key: scene for key, scene in self._scene_of.items() if key in kept}

    def _panel_image(self, job: Job, progress: Progress, spans: Spans) -> Result:
        eia = self._eia(job, progress, spans)
        progress(1.0)
        mount = _display(job).panel.mount
        with spans.span("encode"):
            if job.media == encoding.EXR:
                assert eia.linear is not None
                body = encoding.exr(stored(eia.linear, mount), eia.metadata)
            else:
                body = encoding.encoded(stored(eia.pixels, mount), job.media, eia.metadata)
        return _result(job, body, stored(eia.pixels, mount), eia.report, spans)

    def _seen(self, job: Job, seen: Seen, progress: Progress, spans: Spans) -> Result:
        display = _display(job)
        places = stands(display, seen.angle, seen.eye, seen.sweep)
        eia = self._eia(job, progress, spans)
        eye_views = int(eia.metadata["lfd:eye-views"])
        pictures = []
        with spans.span("look"):
            for index, place in enumerate(places):
                progress(index / len(places))
                eyes = place.eyes(seen.eyes_apart if seen.stereo else None)
                pictures += [
                    look_from(
                        eia.pixels, display, eye, eye_views, seen.size,
                        sigma_views=seen.crosstalk, optics=seen.optics,
                    )
                    for eye in eyes
                ]  # fmt: skip
        progress(1.0)
        picture = side_by_side(pictures)
        with spans.span("encode"):
            body = encoding.encoded(picture, job.media)
        return _result(job, body, picture, eia.report, spans)

    def _views(
        self,
        job: Job,
        progress: Progress,
        spans: Spans,
        rig: Rig | None = None,
        **changed: Any,
    ) -> NDArray[np.uint8]:
        """Upright views, uint8 [view, y, x, 3], of the job's choices but for those changed."""
        scene, display, choices = self._scene(job, spans), _display(job), job.choices
        options = choices.options() | changed
        self._staged = None
        with spans.span("frame"):
            return self._renderer.views(
                scene, display, choices.window(scene, display), rig=rig, progress=progress,
                **options,
            )  # fmt: skip

    def _one_view(self, job: Job, view: OneView, progress: Progress, spans: Spans) -> Result:
        display, choices = _display(job), job.choices
        if choices.views == "continuous":
            raise OptionError("views", "'continuous' is for panel images; give a number")
        count = choices.views or display.views
        if view.angle is not None:
            rig = Rig.single(display, np.deg2rad(view.angle))
        else:
            assert view.index is not None
            if not 0 <= view.index < count:
                raise OptionError("index", f"{view.index}; give a view from 0 to {count - 1}")
            rig = Rig.of(display, count, choices.spacing).only(view.index)
        size = choices.view_size or upright_size(display, count)
        picture = self._views(job, progress, spans, rig, view_size=size)[0]
        progress(1.0)
        with spans.span("encode"):
            body = encoding.encoded(picture, job.media, _text(job))
        return _result(job, body, picture, self._report(job), spans)

    def _all_views(self, job: Job, progress: Progress, spans: Spans) -> Result:
        pictures = self._views(job, progress, spans)
        text = _text(job) | {"lfd:views": str(len(pictures))}

        def file(index: int) -> tuple[str, bytes]:
            progress(1.0)
            told = text | {"lfd:view": str(index)}
            return f"view_{index:03d}.png", encoding.encoded(pictures[index], encoding.PNG, told)

        with spans.span("encode"):
            body = encoding.zipped(map(file, range(len(pictures))))
        return _result(job, body, pictures[0], self._report(job), spans)

    def _quilt(self, job: Job, asked: QuiltPicture, progress: Progress, spans: Spans) -> Result:
        display = _display(job)
        size = chosen_size(display, asked.device, asked.tiles, asked.size)
        views = self._views(job, progress, spans, views=size.views, view_size=size.view_px)
        progress(1.0)
        aspect = display.size_mm[0] / display.size_mm[1]
        pixels = (size.width_px, size.height_px)
        quilt = Quilt(views, size.columns, size.rows, aspect, pixels, _text(job))
        with spans.span("encode"):
            body = encoding.encoded(
                quilt.pixels,
                job.media,
                quilt.metadata | stored_text(quilt.layout),
                comment_exif(quilt.layout),
            )
        tiling = {"tiles": [size.columns, size.rows], "aspect": aspect}
        return _result(job, body, quilt.pixels, self._report(job) | tiling, spans)

    def _report(self, job: Job) -> dict[str, Any]:
        return {
            "technique": job.choices.technique,
            "preset": job.choices.preset,
            "renderer": self._renderer.device.name,
            "warnings": list(self._renderer.warnings),
        }

    def _facts(self, job: Job, asked: SceneFacts, spans: Spans) -> Result:
        scene = self._scene(job, spans)
        low, high = scene.bounds()
        hint = exposure_hint(scene)
        facts = {
            "triangles": scene.triangle_count,
            "meshes": len(scene.meshes),
            "materials": len(scene.materials),
            "images": len(scene.images),
            "lights": len(scene.lights),
            "cameras": [camera.name for camera in scene.cameras],
            "bounds": [low.tolist(), high.tolist()],
            "bytes": scene_bytes(scene),
            "warnings": [*scene.warnings, *([hint] if hint else [])],
        }
        if asked.digest:
            facts["digest"] = scene_digest(scene)
        return Result(b"", encoding.JSON, facts, spans.ms)


class Spans:
    """Named spans of wall clock in milliseconds."""

    def __init__(self) -> None:
        self.ms: dict[str, float] = {}

    @contextmanager
    def span(self, name: str) -> Iterator[None]:
        """Time what runs inside under a name."""
        started = time.perf_counter()
        yield
        self.ms[name] = round(1000 * (time.perf_counter() - started), 3)

    def add(self, spans: dict[str, float]) -> None:
        """Take over what another clock measured."""
        self.ms |= spans


def _display(job: Job) -> DisplayProfile:
    assert job.display is not None
    return job.display


def _text(job: Job) -> dict[str, str]:
    """What files of views say about themselves."""
    display = _display(job)
    return {
        "lfd:profile": display.name,
        "lfd:profile-hash": display.hash,
        "lfd:technique": job.choices.technique,
        "lfd:preset": job.choices.preset,
        "lfd:seed": str(job.choices.seed),
    }


def _result(
    job: Job, body: bytes, picture: NDArray[np.uint8], report: dict[str, Any], spans: Spans
) -> Result:
    height, width = picture.shape[:2]
    report = {k: v for k, v in report.items() if k != "timings_ms"} | {"size": [width, height]}
    return Result(body, job.media, report, spans.ms)


def _view_map(job: Job, spans: Spans) -> Result:
    display = _display(job)
    views = job.choices.views or display.views
    if not isinstance(views, int):
        raise UsageError("views 'continuous': a map has a number of views; give one")
    if job.media == encoding.PNG and views > 256:
        raise OptionError("views", f"{views} do not fit into 8 bits; ask for {encoding.NPY}")
    with spans.span("map"):
        index = stored(display.view_index_map(views), display.panel.mount)
    with spans.span("encode"):
        pixels = index.astype(np.uint8)
        npy = job.media == encoding.NPY
        body = encoding.npy(index) if npy else encoding.encoded(pixels, job.media)
    return _result(job, body, pixels, {"views": views}, spans)


def _pattern(job: Job, pattern: Pattern, spans: Spans) -> Result:
    with spans.span("map"):
        picture = pattern_picture(_display(job), pattern)
    with spans.span("encode"):
        body = encoding.encoded(picture, job.media)
    return _result(job, body, picture, {}, spans)


def scene_bytes(scene: Scene) -> int:
    """Bytes of all arrays of a scene's meshes, pictures, skins and instances."""
    return sum(map(_array_bytes, (*scene.meshes, *scene.images, *scene.skins, *scene.instances)))


def _array_bytes(thing: Any) -> int:
    if isinstance(thing, np.ndarray):
        return thing.nbytes
    if isinstance(thing, tuple):
        return sum(map(_array_bytes, thing))
    if hasattr(thing, "__dataclass_fields__"):
        return sum(_array_bytes(getattr(thing, f.name)) for f in fields(thing))
    return 0

"""Hardware rasterisation of views by any pipeline of the catalogue."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from contextlib import AbstractContextManager

from lfd_render.errors import UnsupportedError
from lfd_render.gpu import raw as gl
from lfd_render.gpu.device import Device
from lfd_render.gpu.framebuffer import IndexedDraws, face_culling, rasterising
from lfd_render.gpu.layout import lod_constants
from lfd_render.gpu.memory import Buffer, TextureArray
from lfd_render.gpu.pass_target import Color, Layers, PassTarget
from lfd_render.gpu.programs import RasterProgram, Uniform
from lfd_render.gpu.scene_buffers import Batch, DrawRun, SceneBuffers
from lfd_render.passes.pipelines import SHADED, Parts, Pipeline
from lfd_render.passes.placement import Placement, gl_matrix
from lfd_render.passes.raster_views import band_views
from lfd_render.passes.view_target import ViewTarget

_GEOMETRY = {"loop": "raster/loop.geom", "invocations": "raster/invocations.geom"}
SOLID = ("opaque", "mask")
BLENDED = ("blend",)
_PARTITION_CLIPS = 6
_WINDOW_CLIPS = 2


class Raster:
    """SceneBuffers, views → one fragment shader's outputs, nearest triangles first, pass by pass.

    `colors` and `depth` are [layer, y, x], each view in its part (`parts`), row 0 on top.
    """

    def __init__(
        self,
        device: Device,
        scene: SceneBuffers,
        parts: Parts,
        *,
        pipeline: Pipeline,
        fragment: str,
        colors: Sequence[TextureArray],
        constants: Mapping[str, int],
        components: int = SHADED,
        keep_depth: bool = False,
    ) -> None:
        """fragment: path of the shader. keep_depth: from each view to the next pass over it.

        Raises UnsupportedError where the device cannot draw so many views by the pipeline.
        """
        if problem := pipeline.problem(device, parts.views, components=components):
            raise UnsupportedError(f"mvr '{pipeline.name}': {problem}")
        self.parts = parts
        self.pipeline = pipeline
        self.passes = pipeline.passes(parts.views)
        self.colors = colors
        self._device = device
        self._scene = scene
        width, height, layers = parts.size
        longest = len(self.passes[0]) if pipeline.layered else 1
        self.depth = TextureArray(
            device, "depth", (width, height, layers if keep_depth else longest),
            gl.DEPTH_COMPONENT32F,
        )  # fmt: skip
        self._targets = self._make_targets(keep_depth=keep_depth)
        self._clips = _PARTITION_CLIPS if pipeline.clipping == "planes" else _WINDOW_CLIPS
        self._programs = {
            alpha_mode: self._program(fragment, alpha_mode, constants)
            for alpha_mode in sorted({batch.alpha_mode for batch in scene.batches})
        }
        self._indices: list[Buffer] = []
        self._draws: list[IndexedDraws] = []
        for batch in scene.batches:
            self._indices.append(Buffer.of(device, "indices", batch.corner_indices()))
            program = self._programs[batch.alpha_mode]
            self._draws.append(IndexedDraws(device, program, self._indices[-1]))

    def _make_targets(self, *, keep_depth: bool) -> list[PassTarget]:
        """A framebuffer for each pass; passes over parts of one layer share theirs."""
        reached = "layered" if self.pipeline.layered else "layer"
        if self.pipeline.amplification == "multiview":
            reached = "multiview"
        targets: dict[int, PassTarget] = {}
        found = []
        for views in self.passes:
            first = self.parts.corner(views[0])[2]
            count = len(views) if self.pipeline.layered else 1
            if first not in targets:
                targets[first] = PassTarget(
                    self._device,
                    [Layers(color, first, count) for color in self.colors],
                    Layers(self.depth, first if keep_depth else 0, count),
                    reached=reached,
                )
            found.append(targets[first])
        return found

    def _program(
        self, fragment: str, alpha_mode: str, constants: Mapping[str, int]
    ) -> RasterProgram:
        pipeline = self.pipeline
        vertex = "each"
        if pipeline.geometry:
            vertex = "corners"
        elif pipeline.layered:
            vertex = "multiview" if pipeline.amplification == "multiview" else "layered"
        return RasterProgram(
            self._device,
            f"raster/{vertex}.vert",
            fragment,
            {
                "ALPHA_TESTED": int(alpha_mode != "opaque"),
                "BLENDED": int(alpha_mode == "blend"),
                "VIEWS_A_PASS": len(self.passes[0]),
                "CLIPS": self._clips,
                "LAYERED": int(pipeline.layered),
                "FRAGMENT_CLIPPING": int(pipeline.clipping == "fragments"),
                "FRUSTUM_CULLING": int("frustum" in pipeline.culling),
                "BACKFACE_CULLING": int("backface" in pipeline.culling),
                **self._scene.constants(),
                **constants,
            },
            geometry_path=_GEOMETRY.get(pipeline.amplification),
        )

    def clear(self, step: int, color: Color | int, *, depth: bool = True) -> None:
        """Empty the target of a pass, unless an earlier pass shares it."""
        if step == 0 or self._targets[step] is not self._targets[step - 1]:
            self._targets[step].clear(color, depth=depth)

    def draw(
        self, step: int, modes: Collection[str], views: Buffer, rows: int, placement: Placement
    ) -> None:
        """Draw the batches of some alpha modes in one pass. views: RasterViews; rows: of the views
        that are drawn."""
        seen = self.passes[step]
        width, height, _ = self.parts.size
        if self.pipeline.clipping == "viewport":
            x, y, _ = self.parts.corner(seen[0])
            self._targets[step].use(x, y, self.parts.columns, rows)
        else:
            self._targets[step].use(0, 0, width, height if self.pipeline.partitioned else rows)
        instances = len(seen) if self.pipeline.amplification == "instanced" else 1
        for batch, draws in zip(self._scene.batches, self._draws, strict=True):
            if batch.alpha_mode in modes:
                program = self._programs[batch.alpha_mode]
                self._set(program, batch, views, seen, placement)
                for run in self._scene.runs(batch):
                    self._set_run(program, batch, run)
                    draws.draw(run.first, run.count, instances)

    def _set(
        self,
        program: RasterProgram,
        batch: Batch,
        views: Buffer,
        seen: range,
        placement: Placement,
    ) -> None:
        lighting = self._scene.lighting
        uniforms: dict[str, Uniform] = {
            "first_view": seen[0],
            "first_triangle": 0,
            "turn_from_display": gl_matrix(placement.turn_from_display),
        }
        if self.pipeline.geometry:
            uniforms |= {"views": len(seen), "facing": 0}
        program.set(
            {
                "DisplayVertices": batch.display_vertices,
                "LocalPositions": batch.local_positions,
                "Draws": self._scene.draws,
                **batch.attributes(),
                "RasterViews": views,
                **self._scene.materials_of(),
                **lighting.buffers(),
            },
            uniforms,
            {**self._scene.samplers(), **lighting.samplers()},
        )

    def _set_run(self, program: RasterProgram, batch: Batch, run: DrawRun) -> None:
        """Name a run's triangles, and cull the sides that its materials and placements hide."""
        face_culling(self._device, double_sided=run.double_sided, mirrored=run.mirrored)
        program.change("first_triangle", batch.triangle_base + run.first)
        program.change("facing", run.facing)

    def rasterising(self) -> AbstractContextManager[None]:
        """The state that draws need."""
        return rasterising(self._device, self._clips)

    def release(self) -> None:
        """Free everything but the colours."""
        for owner in (*self._draws, *self._indices, *self._programs.values()):
            owner.release()
        for target in dict.fromkeys(self._targets):
            target.release()
        self.depth.release()


class BandRaster:
    """A raster of the views of a ViewTarget, band by band.

    colors: its own textures, [layer, y, x], views in their `parts`; none where it draws images.
    """

    def __init__(
        self,
        device: Device,
        scene: SceneBuffers,
        target: ViewTarget,
        *,
        lod: str,
        pipeline: Pipeline,
        fragment: str,
        formats: Sequence[int],
        components: int = SHADED,
        keep_depth: bool = False,
        into_images: bool = False,
    ) -> None:
        """formats: of the colours, in textures of their own; into_images: instead in the target's
        images, where views are layers."""
        assert lod != "multiview"  # which needs points
        self._device = device
        self.target = target
        self.parts = Parts.of(pipeline, target.rig.views, target.grid.columns, target.band_rows)
        self.colors = [
            TextureArray(device, "raster", self.parts.size, internal_format)
            for internal_format in formats
            if pipeline.partitioned or not into_images
        ]
        for texture in self.colors:
            texture.parameters(gl.NEAREST, gl.NEAREST, ("clamp", "clamp"))
        self.raster = Raster(
            device,
            scene,
            self.parts,
            pipeline=pipeline,
            fragment=fragment,
            colors=self.colors or [target.images],
            constants={**scene.lighting.constants(), **lod_constants(lod)},
            components=components,
            keep_depth=keep_depth,
        )
        self.steps = range(len(self.raster.passes))
        self.views = {
            band: Buffer.of(device, "rig", band_views(target, band, pipeline, self.parts))
            for band in (*target.bands, target.warm_up_band)
        }

    def release(self) -> None:
        """Free everything but the target."""
        self.raster.release()
        for texture in self.colors:
            texture.release()
        for views in self.views.values():
            views.release()

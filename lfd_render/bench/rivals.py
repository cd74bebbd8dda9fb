"""What others would use for the same views: Embree's rays, Mitsuba 3, VTK.

Each is a package of its own, imported when asked for. All see the same scene, eyes and view size.
A frame counts what a moving scene takes: triangles are placed anew and, for rays, the tree is
built anew. What each leaves out of the picture is said beside its time; none weaves a panel image.
Each works in a process of its own, for another's OpenGL context would take the place of ours.
"""

from __future__ import annotations

import importlib
import multiprocessing
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lfd_render.display import Camera, DisplayProfile, Rig
from lfd_render.errors import GpuError, LfdError, UsageError
from lfd_render.scene import Scene

Float32 = NDArray[np.float32]
Pixels = NDArray[np.uint8]


class Rival(Protocol):
    """Renders all views of a rig. leaves_out: what its picture lacks, for tables."""

    leaves_out: str

    def render(self, p_display: Float32) -> NDArray[np.bool_]:
        """Views of triangles [m, corner, xyz] in mm of display space: which pixels show one,
        [view, y, x], rows top to bottom."""
        ...


def _rays(rig: Rig, view: int, size: tuple[int, int]) -> tuple[Float32, Float32]:
    """Origins and directions through pixel centres, rows top to bottom, [pixel, xyz]."""
    width, height = size
    w, h = rig.panel_mm
    x = ((np.arange(width) + 0.5) / width - 0.5) * w
    y = (0.5 - (np.arange(height) + 0.5) / height) * h
    eye = np.array([rig.eye_x_mm[view], 0.0, rig.distance_mm])
    window = np.stack((*np.meshgrid(x, y), np.zeros((height, width))), axis=-1)
    directions = (window - eye).reshape(-1, 3).astype(np.float32)
    return np.broadcast_to(eye.astype(np.float32), directions.shape), directions


class Embree:
    """Nearest hits by embreex, a thread a core, each with its own part of the views."""

    leaves_out = "shading, textures, panel image: nearest triangles only"

    def __init__(self, rig: Rig, size: tuple[int, int]) -> None:
        self._scenes = _module("embreex.rtcore_scene", "embreex")
        self._meshes = _module("embreex.mesh_construction", "embreex")
        self._rig, self._size = rig, size
        self._pool = ThreadPoolExecutor(len(os.sched_getaffinity(0)))

    def render(self, p_display: Float32) -> NDArray[np.bool_]:
        """Build the tree, then send the rays of all views."""
        scene = self._scenes.EmbreeScene()
        self._meshes.TriangleMesh(scene, p_display)
        width, height = self._size

        def hits(view: int) -> NDArray[np.bool_]:
            origins, directions = _rays(self._rig, view, self._size)
            found = scene.run(np.ascontiguousarray(origins), directions)
            return np.asarray(found >= 0).reshape(height, width)

        hits(0)  # the first rays build the tree, which must not happen twice
        return np.stack(list(self._pool.map(hits, range(self._rig.views))))


class Mitsuba:
    """Nearest hits by Mitsuba 3, its LLVM backend, lit by their own slant to the eye."""

    leaves_out = "materials, textures, lights, panel image: flat grey by slant"

    def __init__(self, rig: Rig, size: tuple[int, int]) -> None:
        self._mi = _module("mitsuba", "mitsuba")
        self._mi.set_variant("llvm_ad_rgb")
        self._dr = _module("drjit", "mitsuba")
        self._rig, self._size = rig, size

    def render(self, p_display: Float32) -> NDArray[np.bool_]:
        """Build the scene, then trace all rays of a view at a time."""
        mi, dr = self._mi, self._dr
        count = len(p_display)
        mesh = mi.Mesh("scene", 3 * count, count)
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = mi.Float(p_display.ravel())
        parameters["faces"] = mi.UInt32(np.arange(3 * count, dtype=np.uint32))
        parameters.update()
        scene = mi.load_dict({"type": "scene", "mesh": mesh})
        width, height = self._size
        views = []
        for view in range(self._rig.views):
            origins, directions = _rays(self._rig, view, self._size)
            ray = mi.Ray3f(
                mi.Point3f(*(float(c) for c in origins[0])),
                mi.Vector3f(*(mi.Float(np.ascontiguousarray(c)) for c in directions.T)),
            )
            found = scene.ray_intersect(ray)
            grey = dr.abs(dr.dot(found.n, dr.normalize(ray.d)))
            shown = dr.select(found.is_valid(), grey + 1e-3, 0.0)
            views.append(np.asarray(shown).reshape(height, width) > 0)
        return np.stack(views)


class Vtk:
    """VTK's own renderer through OpenGL, off screen, a pass a view as its users would write it."""

    leaves_out = "textures, materials, panel image: one grey, flat"

    def __init__(self, rig: Rig, size: tuple[int, int]) -> None:
        # The first import registers the OpenGL classes that the second's factories make.
        _module("vtkmodules.vtkRenderingOpenGL2", "vtk")
        core = _module("vtkmodules.vtkRenderingCore", "vtk")
        self._data = _module("vtkmodules.vtkCommonDataModel", "vtk")
        self._common = _module("vtkmodules.vtkCommonCore", "vtk")
        self._math = _module("vtkmodules.vtkCommonMath", "vtk")
        self._numpy = _module("vtkmodules.util.numpy_support", "vtk")
        self._rig, self._size = rig, size
        self._window, self._renderer = core.vtkRenderWindow(), core.vtkRenderer()
        self._window.SetOffScreenRendering(1)
        self._window.SetMultiSamples(0)
        self._window.SetSize(*size)
        self._window.AddRenderer(self._renderer)
        self._renderer.SetBackground(0.0, 0.0, 0.0)
        self._mapper, actor = core.vtkPolyDataMapper(), core.vtkActor()
        actor.SetMapper(self._mapper)
        actor.GetProperty().SetAmbient(0.3)
        actor.GetProperty().SetInterpolationToFlat()
        self._renderer.AddActor(actor)

    def render(self, p_display: Float32) -> NDArray[np.bool_]:
        """Upload the triangles, then draw and read view by view."""
        self._upload(p_display)
        rig, camera = self._rig, self._renderer.GetActiveCamera()
        width, height = self._size
        camera.SetUseExplicitProjectionTransformMatrix(True)
        views = np.empty((rig.views, height, width), np.bool_)
        for view in range(rig.views):
            x = float(rig.eye_x_mm[view])
            camera.SetPosition(x, 0.0, rig.distance_mm)
            camera.SetFocalPoint(x, 0.0, 0.0)
            camera.SetExplicitProjectionTransformMatrix(self._frustum(x))
            self._window.Render()
            pixels = self._common.vtkUnsignedCharArray()
            self._window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, pixels)
            codes = self._numpy.vtk_to_numpy(pixels).reshape(height, width, 4)
            views[view] = codes[::-1, :, :3].any(axis=-1)
        return views

    def _frustum(self, x: float) -> Any:
        """clip_from_view of the window seen off its axis, whose pixels need not be square."""
        rig = self._rig
        w, h = rig.panel_mm
        near, far = rig.near_mm, 50 * rig.distance_mm
        matrix = self._math.vtkMatrix4x4()
        rows = (
            (2 * rig.distance_mm / w, 0.0, -2 * x / w, 0.0),
            (0.0, 2 * rig.distance_mm / h, 0.0, 0.0),
            (0.0, 0.0, -(far + near) / (far - near), -2 * far * near / (far - near)),
            (0.0, 0.0, -1.0, 0.0),
        )
        for i, j in np.ndindex(4, 4):
            matrix.SetElement(i, j, rows[i][j])
        return matrix

    def _upload(self, p_display: Float32) -> None:
        count = len(p_display)
        points, cells = self._common.vtkPoints(), self._data.vtkCellArray()
        points.SetData(self._numpy.numpy_to_vtk(p_display.reshape(-1, 3), deep=True))
        index = self._numpy.numpy_to_vtkIdTypeArray
        cells.SetData(
            index(np.arange(0, 3 * count + 1, 3, dtype=np.int64), deep=True),
            index(np.arange(3 * count, dtype=np.int64), deep=True),
        )
        data = self._data.vtkPolyData()
        data.SetPoints(points)
        data.SetPolys(cells)
        self._mapper.SetInputData(data)


RIVALS: dict[str, Callable[[Rig, tuple[int, int]], Rival]] = {
    "embree": Embree,
    "mitsuba": Mitsuba,
    "vtk": Vtk,
}


def corners_of(scene: Scene) -> Float32:
    """All triangles of a scene at rest in world space, [m, corner, xyz]."""
    parts = []
    for instance in scene.instances:
        mesh, matrix = scene.meshes[instance.mesh], instance.world_from_local
        placed = mesh.positions.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
        parts.append(placed[mesh.triangles].astype(np.float32))
    return np.concatenate(parts)


class Outside:
    """A rival at work in its own process, frame after frame of one scene at rest.

    Raises UsageError where its package is missing, GpuError where it fails.
    """

    def __init__(
        self, name: str, scene: Scene, display: DisplayProfile, views: int, size: tuple[int, int]
    ) -> None:
        self.shown: NDArray[np.bool_] | None = None  # of the last frame, [view, y, x]
        self._panel_mm = display.size_mm
        self._pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))
        try:
            self.leaves_out: str = self._call(_begin, name, display.rig(views), size,
                                              corners_of(scene))  # fmt: skip
        except BaseException:
            self.close()
            raise

    def frame(self, camera: Camera) -> float:
        """Place, build and render; its milliseconds, measured where it works."""
        ms, self.shown = self._call(_frame, camera.display_from_world(self._panel_mm))
        return float(ms)

    def close(self) -> None:
        """End its process."""
        self._pool.shutdown(cancel_futures=True)

    def _call(self, work: Callable[..., Any], *arguments: object) -> Any:
        try:
            return self._pool.submit(work, *arguments).result()
        except (LfdError, MemoryError):
            raise
        except BrokenProcessPool as error:
            raise GpuError("its process died") from error
        except Exception as error:  # whatever a program from outside raises is its own gap
            raise GpuError(f"fails: {type(error).__name__}: {error}") from error


_working: tuple[Rival, Float32] | None = None  # in the rival's own process


def _begin(name: str, rig: Rig, size: tuple[int, int], p_world: Float32) -> str:
    global _working  # noqa: PLW0603 (what the process is for)
    rival = RIVALS[name](rig, size)
    _working = rival, p_world
    return rival.leaves_out


def _frame(display_from_world: NDArray[np.float64]) -> tuple[float, NDArray[np.bool_]]:
    assert _working is not None
    rival, p_world = _working
    begun = time.perf_counter()
    matrix = display_from_world.astype(np.float32)
    shown = rival.render(np.asarray(p_world @ matrix[:3, :3].T + matrix[:3, 3], np.float32))
    return 1000 * (time.perf_counter() - begun), shown


def check_names(names: Sequence[str]) -> tuple[str, ...]:
    """Names of rivals, none twice. Raises UsageError."""
    for name in names:
        if name not in RIVALS:
            raise UsageError(f"rival '{name}': unknown; use {', '.join(RIVALS)}")
    return tuple(dict.fromkeys(names))


def _module(name: str, package: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as cause:
        raise UsageError(f"needs {package}: pip install {package}") from cause

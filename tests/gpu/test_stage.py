"""Frames of a stage: the bits of single calls, and nothing made or compiled between them."""

import dataclasses
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import moderngl
import numpy as np
import pytest

from lfd_render.display import Camera, DisplayProfile
from lfd_render.errors import ResourceError, SceneError, UsageError
from lfd_render.gpu.device import Device
from lfd_render.gpu.memory import Buffer
from lfd_render.gpu.programs import Kernel
from lfd_render.gpu.scene_buffers import Batch
from lfd_render.passes.sample import PointCloud, Sample
from lfd_render.passes.transform import Transform
from lfd_render.passes.view_target import Band
from lfd_render.renderer import Renderer
from lfd_render.scene import Pose, Scene, node_transform

from . import moving
from .helpers import PAPER
from .moving import SMALL, reed, reed_camera, reed_pose
from .test_pipeline import small_display

pytestmark = pytest.mark.needs("gl")

MAKERS = (
    "buffer", "compute_shader", "program", "vertex_array", "texture", "texture3d", "texture_array",
    "texture_cube", "framebuffer", "renderbuffer", "sampler", "query",
)  # fmt: skip


@pytest.fixture(scope="module")
def display() -> DisplayProfile:
    return small_display()


@pytest.fixture(scope="module")
def camera(display: DisplayProfile) -> Camera:
    return reed_camera(display)


@contextmanager
def counting(device: Device) -> Iterator[Counter[str]]:
    """Counts what is compiled and made through either of the ways that gpu/ has to OpenGL."""
    made: Counter[str] = Counter()

    def counted(name: str, function: object) -> object:
        def call(*args: object, **options: object) -> object:
            made[name] += 1
            return function(*args, **options)  # type: ignore[operator]

        return call

    with pytest.MonkeyPatch.context() as patch:
        for name in MAKERS:
            original = getattr(moderngl.Context, name)
            patch.setattr(moderngl.Context, name, counted(name, original))
        functions = device.raw._functions
        for name in functions:
            if name.startswith("glCreate") or "Storage" in name:
                patch.setitem(functions, name, counted(name, functions[name]))
        yield made


def held(device: Device) -> tuple[object, ...]:
    """What lives on the device, and its bytes."""
    return list(device.owned), dict(device.ledger.by_label)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"splat": "two-pass"},
        {"technique": "mvr"},
        {"technique": "mvr", "mvr": "instanced-4-partitioned-deferred"},
        {"preset": "paper"},
        {"preset": "paper", "point_source": "raster"},
    ],
    ids=["owned", "two-pass", "mvr", "mvr-deferred", "paper", "raster"],
)
def test_frames_make_and_compile_nothing(
    device: Device, display: DisplayProfile, camera: Camera, options: dict[str, str]
) -> None:
    with Renderer(device) as renderer, renderer.stage(reed(), display, camera, **options) as stage:
        for time in (0.8, 1.6):  # the widest and the highest: frames after need no more room
            stage.frame(pose=reed_pose(time))
        before = held(device)
        with counting(device) as made:
            for time in np.linspace(1.5, 0.1, 6):
                stage.frame(camera.turned(0.02 * time), reed_pose(time))
            stage.read()
        assert not made
        assert held(device) == before


@pytest.mark.parametrize("fault", ["allocates", "compiles", "keeps"])
def test_planted_faults_are_counted(
    device: Device,
    display: DisplayProfile,
    camera: Camera,
    monkeypatch: pytest.MonkeyPatch,
    fault: str,
) -> None:
    original = Transform.__call__

    def wrong(self: Transform, *args: object) -> None:
        if fault == "compiles":
            Kernel(device, "transform/flat.comp").release()
        else:
            buffer = Buffer(device, "planted", 64)
            if fault == "allocates":
                buffer.release()
        original(self, *args)  # type: ignore[arg-type]

    with Renderer(device) as renderer, renderer.stage(reed(), display, camera) as stage:
        stage.frame(pose=reed_pose(1.6))
        monkeypatch.setattr(Transform, "__call__", wrong)
        before = held(device)
        with counting(device) as made:
            stage.frame(pose=reed_pose(1.0))
        assert made == ({"compute_shader": 1} if fault == "compiles" else {"buffer": 1})
        assert (held(device) == before) == (fault != "keeps")
        for thing in set(device.owned) - set(before[0]):  # type: ignore[call-overload]
            thing.release()


@pytest.mark.parametrize("technique", ["lfdpr", "mvr"])
def test_a_frame_does_not_depend_on_those_before(
    device: Device, display: DisplayProfile, camera: Camera, technique: str
) -> None:
    """A stage's frame, after others, is that of a call of its own with a new renderer; the near
    frame outgrows the buffers that the first ones needed."""
    scene, near = reed(), dataclasses.replace(camera, window_height=0.5)
    asked = [(camera, reed_pose(0.3)), (camera, None), (near, reed_pose(1.1)), (camera, None)]
    with (
        Renderer(device) as renderer,
        renderer.stage(scene, display, camera, technique=technique) as stage,
    ):
        found = [stage.render(*each) for each in asked]
    for eia, (where, pose) in zip(found, asked, strict=True):
        with Renderer(device) as renderer:
            alone = renderer.render(scene, display, where, pose=pose, technique=technique)
        np.testing.assert_array_equal(eia.pixels, alone.pixels)
        np.testing.assert_array_equal(eia.linear.view(np.uint16), alone.linear.view(np.uint16))
        assert eia.report["points"] == alone.report["points"]
        assert eia.metadata == alone.metadata
    assert np.any(found[0].pixels != found[1].pixels)
    np.testing.assert_array_equal(found[1].pixels, found[3].pixels)


def test_a_pose_gives_the_same_bits_in_another_process(device: Device, tmp_path: Path) -> None:
    out = tmp_path / "views.npy"
    done = subprocess.run(
        [sys.executable, moving.__file__, str(out)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    display = DisplayProfile.load(PAPER)
    with Renderer(device) as renderer:
        found = [
            renderer.views(reed(), display, reed_camera(display), pose=pose, **SMALL)
            for pose in (reed_pose(1.0), reed_pose(1.01))
        ]
    expected = np.load(out)
    np.testing.assert_array_equal(found[0], expected)
    assert np.any(found[1] != expected)


# ---- how long a stage lives -------------------------------------------------------------------


def test_render_stays_staged(device: Device, display: DisplayProfile, camera: Camera) -> None:
    scene = reed()
    with Renderer(device) as renderer:
        first = renderer.render(scene, display, camera, repeat=2)
        before = held(device)
        with counting(device) as made:
            again = renderer.render(scene, display, camera.turned(0.01), exposure=2.0)
            same = renderer.render(scene, display, camera, background=(0.0, 0.0, 0.0))
        assert not made
        assert held(device) == before
        other = renderer.render(scene, display, camera, lod="area")
    assert "compile" in first.report["timings_ms"]
    assert "compile" not in again.report["timings_ms"]
    assert "compile" in other.report["timings_ms"]
    assert "upload" not in other.report["timings_ms"]
    np.testing.assert_array_equal(first.pixels, same.pixels)
    assert again.pixels.mean() > first.pixels.mean()


def test_stage_is_asked_again(device: Device, display: DisplayProfile, camera: Camera) -> None:
    scene = reed()
    with Renderer(device) as renderer:
        stage = renderer.stage(scene, display, camera)
        with pytest.raises(UsageError, match="stage: no frame since the last read"):
            stage.read()
        assert renderer.stage(scene, display, camera, exposure=2.0) is stage
        bright = stage.render()
        other = renderer.stage(scene, display, camera, seed=1)
        assert other is not stage
        with pytest.raises(UsageError, match="stage: it has ended"):
            stage.frame()
        renderer.views(scene, display, camera, **SMALL)
        with pytest.raises(UsageError, match="stage: it has ended"):
            other.render()
        plain = renderer.render(scene, display, camera)
        last = renderer.stage(scene, display, camera)
    assert bright.pixels.mean() > plain.pixels.mean()
    with pytest.raises(UsageError, match="stage: it has ended"):
        last.frame()


def test_closing_a_stage_frees_it(device: Device, display: DisplayProfile, camera: Camera) -> None:
    before = device.ledger.total
    renderer = Renderer(device)
    with renderer.stage(reed(), display, camera) as stage:
        stage.frame()
        staged = device.ledger.total
    uploaded = device.ledger.total
    stage.close()
    renderer.close()
    assert before < uploaded < staged
    assert device.ledger.total == before


@pytest.mark.parametrize(
    ("eye_z", "pose", "message"),
    [
        (1.0, Pose({"nowhere": np.eye(4)}), "pose: node 'nowhere': no node has this name"),
        (1.0, Pose({"tip": node_transform((1e300, 0, 0))}), "scene 'reed': joints or morph"),
        (-1.0, None, "behind the viewer"),
    ],
)
def test_bad_input_leaves_a_stage_usable(
    device: Device,
    display: DisplayProfile,
    camera: Camera,
    eye_z: float,
    pose: Pose | None,
    message: str,
) -> None:
    # Looking from before the scene away from it, or at it.
    away = dataclasses.replace(camera, target=(0, 0, 30 - 30 * eye_z), eye_direction=(0, 0, eye_z))
    with Renderer(device) as renderer, renderer.stage(reed(), display, camera) as stage:
        expected = stage.render(pose=reed_pose(1.0))
        with pytest.raises(SceneError, match=message):
            stage.render(away, pose)
        np.testing.assert_array_equal(stage.render(pose=reed_pose(1.0)).pixels, expected.pixels)


def test_a_frame_that_fails_ends_its_stage(
    device: Device, display: DisplayProfile, camera: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = device.ledger.total
    renderer = Renderer(device)
    stage = renderer.stage(reed(), display, camera)

    def fails(*_: object) -> None:
        raise ResourceError("planted")

    with monkeypatch.context() as patch:
        patch.setattr(Transform, "__call__", fails)
        with pytest.raises(ResourceError, match="planted"):
            stage.frame()
    with pytest.raises(UsageError, match="stage: it has ended"):
        stage.frame()
    assert device.ledger.total == before
    assert renderer.render(reed(), display, camera).pixels.any()
    renderer.close()


def test_arguments_of_the_wrong_kind(device: Device, display: DisplayProfile) -> None:
    renderer = Renderer(device)
    with pytest.raises(UsageError, match="scene: 'a file'; give a Scene"):
        renderer.stage("a file", display)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match=r"pose: \{\}; give a Pose"):
        renderer.render(Scene.load("builtin:chart"), display, pose={})  # type: ignore[arg-type]
    with renderer.stage(reed(), display) as stage:
        with pytest.raises(UsageError, match="pose: 3; give a Pose"):
            stage.frame(pose=3)  # type: ignore[arg-type]
        with pytest.raises(UsageError, match="camera: 3; give a Camera"):
            stage.frame(3)  # type: ignore[arg-type]
    renderer.close()


def test_points_are_counted_where_they_lie(
    device: Device, display: DisplayProfile, camera: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    sampled = []
    original = Sample.__call__

    def sample(self: Sample, batch: Batch, points: PointCloud, band: Band) -> None:
        sampled.append(band)
        original(self, batch, points, band)

    with Renderer(device) as renderer, renderer.stage(reed(), display, camera) as stage:
        stage.render()
        monkeypatch.setattr(Sample, "__call__", sample)
        moved = stage.render(camera.turned(0.1)).report["points"]
        assert len(sampled) == len(stage._buffers.batches)
        again = stage._frames.technique
        again._sampled = None  # control: what is not at hand is sampled anew
        assert again.count_points() == moved > 0
        assert len(sampled) == 2 * len(stage._buffers.batches)

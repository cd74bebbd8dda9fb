"""64-bit atomics, two passes of 32-bit ones and owned rows find the same winners, to the bit.

The device is zink on lavapipe, whose OpenGL has NV_shader_atomic_int64, in a process of its own.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

COMPARE = """
import json
import numpy as np
from lfd_render import DisplayProfile, Scene
from lfd_render.display import ViewGrid
from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.gpu.scene_buffers import SceneBuffers
from lfd_render.passes.placement import Placement
from lfd_render.passes.view_buffers import INT64_ATOMICS, PackedViewBuffers
from lfd_render.passes.view_target import ViewTarget
from lfd_render.renderer import camera_for
from lfd_render.scene import Instance, Material
from lfd_render.passes.sampling import Sampling
from lfd_render.techniques import Lfdpr
import dataclasses

display = DisplayProfile.load("gavane-2024-tilted-4k")
device = Device.open("auto")
spheres = Scene.load("builtin:spheres?triangles=4000")
# Every third material blends and every third is cut by its alpha, so that all passes run.
modes = ("opaque", "blend", "mask")
materials = tuple(
    dataclasses.replace(m, alpha_mode=modes[i % 3], base_color=(*m.base_color[:3], 0.6))
    for i, m in enumerate(spheres.materials)
)
scene = dataclasses.replace(spheres, materials=materials)
rig, grid = display.rig(11), ViewGrid.lens(display, 60)
placement = Placement(camera_for(scene, display).display_from_world(display.size_mm), (0, 0, 0))

def frame(winners, general, **sampling):
    buffers = SceneBuffers(device, scene)
    target = ViewTarget(device, rig, grid, buffers.batches)
    choice = Sampling(**sampling)
    technique = Lfdpr(device, buffers, target, winners=winners, general=general, sampling=choice)
    clock = StageClock(device)
    technique.begin(placement, clock)
    technique.warm_up(clock)
    technique.render(target.bands[0], clock)
    images = target.images.read(np.float16, 0x140B)
    words = technique._views.words.read(np.uint32)[:: technique._views.word_stride]
    packed = isinstance(technique._views, PackedViewBuffers)
    technique.release()
    buffers.release()
    device.check()
    return packed, words, images.view(np.uint16)

report = {"has int64": INT64_ATOMICS in device.info.extensions, "renderer": device.name}
for general in (False, True):
    one, words64, images64 = frame("auto", general)
    two, words32, images32 = frame("two-pass", general)
    report[f"general {general}"] = {
        "packed": [one, two],
        "visible": int((words32 != 0xFFFFFFFF).sum()),
        "different words": int((words64 != words32).sum()),
        "different images": int((images64 != images32).sum()),
    }
    if not general:
        _, owned, _ = frame("owned", general)
        report["different owned words"] = int((owned != words32).sum())
        for source in ("compute", "raster"):
            for winners in ("int64", "two-pass"):
                _, cells, _ = frame(winners, general, lattice="paper", source=source)
                report[f"different {source} words by {winners}"] = int((cells != words32).sum())
print(json.dumps(report))
"""


@pytest.mark.needs("zink")
@pytest.mark.shows("64-bit atomics, tested through zink on lavapipe, give the same bits")
def test_both_splat_paths_give_the_same_bits(zink: dict[str, str]) -> None:
    done = subprocess.run(
        [sys.executable, "-c", COMPARE], env=zink, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["has int64"]
    assert "zink" in report["renderer"]
    assert report["different owned words"] == 0
    for source in ("compute", "raster"):
        for winners in ("int64", "two-pass"):
            assert report[f"different {source} words by {winners}"] == 0
    for general in (False, True):
        found = report[f"general {general}"]
        assert found["packed"] == [
            True,
            False,
        ]  # what the device offers is used, and can be refused
        assert found["visible"] > 1000
        assert found["different words"] == found["different images"] == 0


@pytest.mark.needs("zink")
def test_owned_rows_give_the_same_bits_on_random_scenes(zink: dict[str, str]) -> None:
    module = Path(__file__).with_name("test_owned.py")
    tests = [
        f"{module}::test_{name}"
        for name in ("winners_are_those_of_atomics", "a_dispatch_left_out_is_seen")
    ]
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *tests]
    done = subprocess.run(command, env=zink, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert "2 passed" in done.stdout


@pytest.mark.needs("zink")
@pytest.mark.shows("64-bit atomics find what the reference sees, and leave no holes")
def test_64_bit_winners_are_the_references(zink: dict[str, str]) -> None:
    """What `auto` takes there, by the tests that hold the other paths to the same."""
    folder = Path(__file__).parent
    tests = [f"{folder / module}.py" for module in ("test_splat", "test_holes", "test_same_bits")]
    chosen = "48_views or (camera_sees_a_hole and spheres and default) or (division and default)"
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", chosen, *tests]
    done = subprocess.run(command, env=zink, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert "3 passed" in done.stdout

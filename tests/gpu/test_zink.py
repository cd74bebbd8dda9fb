"""Windows and bands through zink on lavapipe, whose compiler turns uniforms into constants.

The device is another than the other tests', so it lives in a process of its own.
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
from lfd_render.passes import sample, view_target
from lfd_render.passes.placement import Placement
from lfd_render.passes.sampling import Sampling
from lfd_render.passes.view_target import ViewTarget
from lfd_render.renderer import camera_for
from lfd_render.techniques import Lfdpr

ROWS = 60
display = DisplayProfile.load("gavane-2024-tilted-4k")
device = Device.open("auto")
scene = Scene.load("builtin:spheres?triangles=4000")
rig, grid = display.rig(11), ViewGrid.lens(display, ROWS)
placement = Placement(camera_for(scene, display).display_from_world(display.size_mm), (0, 0, 0))

def frame(band_rows, window_items):
    view_target.BAND_BYTES = band_rows * 4 * rig.views * grid.columns
    sample.MOST_WINDOW_ITEMS = window_items
    buffers = SceneBuffers(device, scene)
    target = ViewTarget(device, rig, grid, buffers.batches)
    technique = Lfdpr(device, buffers, target, sampling=Sampling(shade="shared"))
    clock = StageClock(device)
    technique.begin(placement, clock)
    technique.warm_up(clock)
    picture = np.zeros((rig.views, ROWS, grid.columns, 4), np.float16)
    for _ in range(4):  # tracks and cells may find too little room at first
        for band in target.bands:
            technique.render(band, clock)
            images = target.images.read(np.float16, 0x140B)
            picture[:, band.first : band.first + band.rows] = images[:, : band.rows]
        if technique.complete():
            break
    else:
        raise AssertionError("never complete")
    windows = [points.windows for points in technique._points]
    technique.release()
    buffers.release()
    device.check()
    return {"bands": len(target.bands), "windows": windows}, picture.view(np.uint16)

whole, expected = frame(ROWS, 1 << 21)
split, found = frame(20, 400)
print(json.dumps({
    "renderer": device.name, "whole": whole, "split": split,
    "visible": int((expected[..., :3] != 0).any(axis=-1).sum()),
    "different": int((found != expected).any(axis=-1).sum()),
}))
"""


@pytest.mark.needs("zink")
def test_no_window_is_lost_where_uniforms_become_constants(zink: dict[str, str]) -> None:
    done = subprocess.run(
        [sys.executable, "-c", COMPARE], env=zink, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert "zink" in report["renderer"]
    assert report["whole"] == {"bands": 1, "windows": [1]}
    assert report["split"]["bands"] == 3
    assert report["split"]["windows"][0] > 1
    assert report["visible"] > 1000
    assert report["different"] == 0


def test_deformation_of_more_than_one_batch(zink: dict[str, str]) -> None:
    """What bounds the deforming kernel's loops changes from batch to batch."""
    file = Path(__file__).with_name("test_deform.py")
    name = "test_displacements_beyond_a_buffer_go_into_more_batches"
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", f"{file}::{name}"],
        env=zink,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert "1 passed" in done.stdout

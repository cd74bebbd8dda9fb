"""The renderer as a guest of its process: memory, errors, closing, numbers that make no picture."""

import dataclasses
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from lfd_render.display import Camera, DisplayProfile
from lfd_render.errors import CancelledError, GpuError, LfdError, ResourceError, UsageError
from lfd_render.gpu.device import Device
from lfd_render.gpu.memory import Buffer, Ledger
from lfd_render.passes.encode import Encode
from lfd_render.passes.weave import Weave
from lfd_render.renderer import Renderer
from lfd_render.scene import Instance, Material, Mesh, Scene

from .helpers import fill

pytestmark = pytest.mark.needs("gl")

SMALL = {"views": 8, "view_size": (40, 30)}  # so many share what they see
KINDS = ({}, {"technique": "mvr"}, {"technique": "mvr", "mvr": "instanced-partitioned-deferred"})


@pytest.fixture(scope="module")
def display() -> DisplayProfile:
    return DisplayProfile.load("gavane-2024-tilted-4k")


@pytest.fixture(scope="module")
def spheres() -> Scene:
    return Scene.load("builtin:spheres?triangles=1000")


def test_closing_twice_is_once(spheres: Scene, display: DisplayProfile) -> None:
    with Renderer() as renderer:
        renderer.views(spheres, display, **SMALL)
        renderer.close()
        renderer.close()
    with pytest.raises(GpuError, match="closed"):
        renderer.views(spheres, display, **SMALL)


def test_another_thread_is_told_whose_device_it_is(spheres: Scene, display: DisplayProfile) -> None:
    def elsewhere() -> None:
        for use in (renderer.views, renderer.render):
            with pytest.raises(GpuError, match="belongs to the thread that opened it"):
                use(spheres, display, **SMALL)

    with Renderer() as renderer:
        expected = renderer.views(spheres, display, **SMALL)
        with ThreadPoolExecutor(1) as pool:
            pool.submit(elsewhere).result()
        np.testing.assert_array_equal(renderer.views(spheres, display, **SMALL), expected)


@pytest.mark.parametrize("method", ["render", "views"])
@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"scene": "helmet.gltf"}, "scene: 'helmet.gltf'; give a Scene, as Scene.load"),
        ({"display": "profile.json"}, "display: 'profile.json'; give a DisplayProfile"),
        ({"camera": "front"}, "camera: 'front'; give a Camera"),
        ({"view_size": "4x4"}, "view size: '4x4' is out of range; use two whole numbers"),
        ({"view_size": (4, 4, 4)}, "view size"),
        ({"view_size": (4.5, 4)}, "view size"),
        ({"views": "8"}, "views: '8' is out of range"),
    ],
)
def test_arguments_of_the_wrong_kind_are_named(
    device: Device,
    spheres: Scene,
    display: DisplayProfile,
    method: str,
    wrong: dict[str, object],
    message: str,
) -> None:
    arguments = {"scene": spheres, "display": display, **SMALL, **wrong}
    with pytest.raises(UsageError, match=f"^{message}"):
        getattr(Renderer(device), method)(**arguments)


@pytest.mark.parametrize("options", KINDS)
def test_many_frames_leave_nothing_behind(
    device: Device, spheres: Scene, display: DisplayProfile, options: dict[str, str]
) -> None:
    before = device.ledger.total
    renderer = Renderer(device)
    renderer.views(spheres, display, **options, **SMALL)
    held, owned = device.ledger.total, len(device.owned)
    for _ in range(5):
        renderer.views(spheres, display, **options, **SMALL)
    assert (device.ledger.total, len(device.owned)) == (held, owned)
    renderer.close()
    assert device.ledger.total == before


@pytest.mark.parametrize("options", KINDS)
def test_a_call_that_fails_anywhere_leaves_nothing_behind(
    device: Device,
    spheres: Scene,
    display: DisplayProfile,
    options: dict[str, str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Every allocation of a call fails once; the planted fault is the failure itself."""
    before, failures = device.ledger.total, 0
    renderer = Renderer(device)
    original = Ledger.add
    for failing in range(1000):
        count = 0

        def add(ledger: Ledger, label: str, size: int, failing: int = failing) -> None:
            nonlocal count
            original(ledger, label, size)
            count += size > 0
            if size > 0 and count == failing + 1:
                raise ResourceError("planted")

        with monkeypatch.context() as patch:
            patch.setattr(Ledger, "add", add)
            try:
                renderer.views(spheres, display, **options, **SMALL)
            except ResourceError:
                failures += 1
            else:
                break
        assert device.ledger.total == before
    assert failures > 10
    renderer.close()
    assert device.ledger.total == before


def test_device_bytes_are_those_of_the_call(device: Device, display: DisplayProfile) -> None:
    small = Scene.load("builtin:spheres?triangles=1000")
    large = Scene.load("builtin:spheres?triangles=100000")
    with Renderer(device) as renderer:
        first, most, again = (
            renderer.render(scene, display, **SMALL).report["device_bytes"]
            for scene in (small, large, small)
        )
    # The scene before is still there while the next is prepared, but for the peak of its frame.
    assert first < most
    assert again < most


def test_a_buffer_is_released_once(device: Device) -> None:
    before = device.ledger.total
    buffer = Buffer(device, "test", 64)
    buffer.release()
    buffer.release()
    assert device.ledger.total == before


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"background": (float("nan"), 0, 0)}, UsageError),
        ({"background": (-1, 0, 0)}, UsageError),
        ({"background": (1e6, 0, 0)}, UsageError),
        ({"exposure": 0.0}, UsageError),
        ({"views": 0}, UsageError),
        ({"views": 1025}, UsageError),
        ({"technique": "magic"}, UsageError),
        ({"preset": "fast"}, UsageError),
        ({"lod": "trilinear"}, UsageError),
        ({"lod": "multiview", "technique": "mvr"}, UsageError),
        ({"projection": "fisheye"}, UsageError),
        ({"splat": "luck"}, UsageError),
        ({"splat": "owned", "projection": "general"}, UsageError),
        ({"splat": "owned", "technique": "mvr"}, UsageError),
        ({"repeat": 0}, UsageError),
        ({"view_size": (0, 10)}, UsageError),
        ({"views": 1024, "view_size": (16384, 16384)}, ResourceError),
    ],
)
def test_options_that_make_no_picture_are_refused(
    device: Device,
    spheres: Scene,
    display: DisplayProfile,
    options: dict[str, object],
    error: type[LfdError],
) -> None:
    renderer = Renderer(device)
    with pytest.raises(error) as raised:
        renderer.render(spheres, display, **options)  # type: ignore[arg-type]
    assert "\n" not in str(raised.value)
    renderer.close()


def test_infinite_light_is_white(device: Device, spheres: Scene, display: DisplayProfile) -> None:
    with Renderer(device) as renderer:
        pixels = renderer.views(
            spheres, display, exposure=1e38, background=(600.0, 600.0, 600.0), **SMALL
        )
    assert pixels.min() > 250


def card(z_mm: float, color: tuple[float, float, float, float], name: str) -> tuple[Mesh, Material]:
    corners = np.float32([[-80, -60, z_mm], [80, -60, z_mm], [80, 60, z_mm], [-80, 60, z_mm]])
    mesh = Mesh(
        name,
        corners,
        np.tile(np.float32([0, 0, 1]), (4, 1)),
        np.zeros((4, 2, 2), np.float32),
        np.ones((4, 4), np.float32),
        np.uint32([[0, 1, 2], [0, 2, 3]]),
        0,
    )
    return mesh, Material(name, base_color=color, alpha_mode="blend", unlit=True)


def centre_of_cards(
    device: Device,
    display: DisplayProfile,
    technique: str,
    *cards: tuple[float, tuple[float, float, float, float]],
) -> list[int]:
    """Colour in the middle of blended cards at depths, over black."""
    made = [card(z, color, f"card {i}") for i, (z, color) in enumerate(cards)]
    meshes = tuple(dataclasses.replace(mesh, material=i) for i, (mesh, _) in enumerate(made))
    instances = tuple(Instance(mesh.name, i, np.eye(4)) for i, mesh in enumerate(meshes))
    scene = Scene("cards", meshes, instances, tuple(material for _, material in made))
    camera = Camera((0, 0, 0), (0, 0, 1), (0, 1, 0), display.size_mm[1])
    with Renderer(device) as renderer:
        views = renderer.views(scene, display, camera, technique=technique, **SMALL)
    found: list[int] = views[1, 15, 20].tolist()
    return found


@pytest.mark.parametrize("technique", ["lfdpr", "mvr"])
def test_a_clear_card_hides_nothing(
    device: Device, display: DisplayProfile, technique: str
) -> None:
    red = (0.0, (0.8, 0.0, 0.0, 0.8))
    clear = (20.0, (0.0, 1.0, 0.0, 0.0))
    alone = centre_of_cards(device, display, technique, red)
    assert centre_of_cards(device, display, technique, red, clear) == alone
    assert alone[0] > 150
    # A card that shows does hide: one layer is drawn.
    green = (20.0, (0.0, 1.0, 0.0, 0.5))
    assert centre_of_cards(device, display, technique, red, green)[1] > 100


@pytest.mark.parametrize(
    ("count", "center", "views"),
    [(480.0, 0.0, 48), (479.36, 1e6, 48), (479.36, -2e4, 1024), (100.0, 1e5, 512)],
)
def test_views_on_a_boundary_and_far_centres_are_exact(
    device: Device, display: DisplayProfile, count: float, center: float, views: int
) -> None:
    """Phases on the boundary of two views, and centres that a float32 cannot hold."""
    lens = display.lens.model_copy(update={"lens_count": count, "center": center, "drift": 0.0})
    panel = display.panel.model_copy(update={"resolution_px": (3840, 216)})
    profile = display.model_copy(update={"lens": lens, "panel": panel})
    from lfd_render.display import ViewGrid  # noqa: PLC0415 (beside what it is for)
    from lfd_render.gpu import raw as gl  # noqa: PLC0415
    from lfd_render.gpu.scene_buffers import SceneBuffers  # noqa: PLC0415
    from lfd_render.passes.view_target import ViewTarget  # noqa: PLC0415

    grid = ViewGrid.lens(profile, 1)
    buffers = SceneBuffers(device, Scene.load("builtin:spheres?triangles=1000"))
    target = ViewTarget(device, profile.rig(views), grid, buffers.batches)
    numbers = np.arange(views)[:, None, None, None]  # half floats hold whole ones up to 2048
    fill(device, target.images, np.broadcast_to(numbers, (views, 1, grid.columns, 3)))
    weave = Weave(device, profile, grid, views)
    weave(target.bands[0])
    found = weave.read_linear().astype(int)
    np.testing.assert_array_equal(found, profile.view_index_map(views))
    assert len(np.unique(found)) >= min(views, 100) // 2
    assert target.images.internal_format == gl.RGBA16F
    for owner in (weave, target, buffers):
        owner.release()


def test_a_picture_larger_than_the_device_is_a_resource_error(device: Device) -> None:
    with pytest.raises(ResourceError, match="picture"):
        Encode(device, device.info.max_texture_size + 1, 8)


@pytest.mark.parametrize("technique", ["lfdpr", "mvr"])
def test_a_wall_beyond_the_window_fills_the_panel(
    device: Device, display: DisplayProfile, technique: str
) -> None:
    """Lenses that begin outside the window included."""
    mesh, material = card(0.0, (1.0, 1.0, 1.0, 1.0), "wall")
    wide = dataclasses.replace(mesh, positions=mesh.positions * np.float32(9.0))
    solid = dataclasses.replace(material, alpha_mode="opaque")
    scene = Scene("wall", (wide,), (Instance("wall", 0, np.eye(4)),), (solid,))
    camera = Camera((0, 0, 0), (0, 0, 1), (0, 1, 0), display.size_mm[1])
    with Renderer(device) as renderer:
        pixels = renderer.render(scene, display, camera, views=48, technique=technique).pixels
    assert pixels.min() > 200


def test_a_first_call_that_is_called_off_leaves_nothing_in_use(
    device: Device, spheres: Scene, display: DisplayProfile
) -> None:
    """What it had put on the device is undone, and so must not be taken to be there."""

    def leave(part: float) -> None:
        raise CancelledError("called off")

    renderer = Renderer(device)
    with pytest.raises(CancelledError):
        renderer.views(spheres, display, **SMALL, progress=leave)
    found = renderer.views(spheres, display, **SMALL)
    assert np.array_equal(found, Renderer(device).views(spheres, display, **SMALL))

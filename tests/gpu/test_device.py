"""The device and what lives on it: choice, names, memory, errors, clocks, shader messages."""

import dataclasses
import time
from pathlib import Path

import numpy as np
import pytest

from lfd_render.errors import GpuError, ResourceError
from lfd_render.gpu import layout, shaders
from lfd_render.gpu import raw as gl
from lfd_render.gpu.clock import StageClock
from lfd_render.gpu.device import Device
from lfd_render.gpu.memory import Buffer, TextureArray
from lfd_render.gpu.programs import Kernel

pytestmark = pytest.mark.needs("gl")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of shaders in place of the project's own."""
    monkeypatch.setattr(shaders, "data_folder", lambda _: tmp_path)
    return tmp_path


DOUBLER = """layout(local_size_x = 1) in;
layout(std430) readonly restrict buffer Input { uint values[]; };
layout(std430) writeonly restrict buffer Output { uint doubled[]; };
uniform uint factor;
void main() { doubled[gl_GlobalInvocationID.x] = factor * values[gl_GlobalInvocationID.x]; }
"""


def test_the_device_says_what_it_is(device: Device) -> None:
    assert device.info.renderer == device.name
    assert device.info.software == any(
        name in device.name.lower() for name in ("llvmpipe", "softpipe", "swrast", "lavapipe")
    )
    assert device.info.max_storage_bytes >= 1 << 27


@pytest.mark.parametrize("choice", ["fastest", "-1", "99"])
def test_an_unknown_device_is_refused(choice: str) -> None:
    with pytest.raises(GpuError, match=choice):
        Device.open(choice)


def test_gpu_is_not_quietly_software() -> None:
    best = Device.open("auto")
    best.close()
    if best.info.software:
        with pytest.raises(GpuError, match="'gpu'"):
            Device.open("gpu")
    else:
        device = Device.open("gpu")
        assert not device.info.software
        device.close()


def test_buffers_bind_by_name(device: Device, folder: Path) -> None:
    (folder / "double.comp").write_text(DOUBLER)
    kernel = Kernel(device, "double.comp")
    source = Buffer.of(device, "test", np.arange(5, dtype=np.uint32))
    result = Buffer(device, "test", 20)
    kernel.set({"Output": result, "Input": source}, {"factor": 2})
    kernel.run((5, 1, 1))
    np.testing.assert_array_equal(result.read(np.uint32), [0, 2, 4, 6, 8])
    with pytest.raises(GpuError, match=r"double.comp.*does not know \['Outputs'\]"):
        kernel.set({"Outputs": result, "Input": source, "Output": result}, {"factor": 2})
    with pytest.raises(GpuError, match=r"lacks \['Input'\]"):
        kernel.set({"Output": result}, {"factor": 2})
    with pytest.raises(GpuError, match=r"lacks \['factor'\]"):
        kernel.set({"Output": result, "Input": source})
    for owner in (source, result, kernel):
        owner.release()


def test_includes_nest_and_come_once(folder: Path) -> None:
    (folder / "a.glsl").write_text('#include "b.glsl"\nfloat a;\n')
    (folder / "b.glsl").write_text("float b;\n")
    (folder / "main.comp").write_text('#include "a.glsl"\n#include "b.glsl"\nvoid main() {}\n')
    source = shaders.assemble("main.comp", {"SIZE": 3})
    assert source.text.count("float b;") == 1
    assert source.text.index("float b;") < source.text.index("float a;")
    assert source.text.startswith("#version 450 core\n")
    assert "#define SIZE 3\n" in source.text
    assert source.files == ["main.comp", "a.glsl", "b.glsl"]


def test_compiler_messages_name_our_files_and_lines(device: Device, folder: Path) -> None:
    (folder / "inner.glsl").write_text("float fine;\nfloat wrong = nonsense;\n")
    (folder / "main.comp").write_text(
        'layout(local_size_x = 1) in;\n#include "inner.glsl"\nvoid main() {}\n'
    )
    with pytest.raises(GpuError, match=r"shaders/inner\.glsl:2.*nonsense"):
        Kernel(device, "main.comp")


def test_a_missing_include_is_named(folder: Path) -> None:
    (folder / "main.comp").write_text('#include "gone.glsl"\n')
    with pytest.raises(GpuError, match=r"gone\.glsl"):
        shaders.assemble("main.comp")


@pytest.mark.parametrize("name", sorted(layout.STRUCTS))
def test_structs_agree_between_numpy_and_glsl(device: Device, folder: Path, name: str) -> None:
    """Each word written by numpy is the word that GLSL reads, array stride included."""
    reads, words = [], 0
    for glsl_type, field in layout.STRUCTS[name]:
        base = f"structs[1].{field}"
        count = layout.dtype(name)[field].itemsize // 4
        if glsl_type == "mat4":
            parts = [f"{base}[{i // 4}][{i % 4}]" for i in range(16)]
        else:
            parts = [base] if count == 1 else [f"{base}[{i}]" for i in range(count)]
        for part in parts:
            floating = glsl_type in ("float", "vec2", "vec4", "mat4")
            word = f"floatBitsToUint({part})" if floating else f"uint({part})"
            reads.append(f"result[{words}] = {word};")
            words += 1
    (folder / "read.comp").write_text(
        f'layout(local_size_x = 1) in;\n#include "layout/{name}"\n'
        f"layout(std430) readonly restrict buffer Structs {{ {name} structs[]; }};\n"
        "layout(std430) writeonly restrict buffer Result { uint result[]; };\n"
        f"void main() {{ {' '.join(reads)} }}\n"
    )
    # Small floats' bits survive a trip through float variables; counting from 1.0's bits on.
    expected = (0x3F800000 + np.arange(words)).astype(np.uint32)
    structs = np.concatenate([np.zeros(words, np.uint32), expected])
    kernel = Kernel(device, "read.comp")
    source, result = Buffer.of(device, "test", structs), Buffer(device, "test", 4 * words)
    kernel.set({"Structs": source, "Result": result})
    kernel.run((1, 1, 1))
    np.testing.assert_array_equal(result.read(np.uint32), expected)
    for owner in (source, result, kernel):
        owner.release()


def test_the_ledger_counts_bytes_and_their_peak(device: Device) -> None:
    before, peak = device.ledger.total, device.ledger.peak
    buffer = Buffer(device, "ledger test", 1000)
    texture = TextureArray(device, "ledger test", (8, 4, 3), gl.RGBA16F)
    assert device.ledger.by_label["ledger test"] == 1000 + 8 * 4 * 3 * 8
    assert device.ledger.peak >= max(peak, device.ledger.total)
    buffer.release()
    texture.release()
    assert device.ledger.total == before
    assert "ledger test" not in device.ledger.by_label


def test_too_large_is_refused_by_name(device: Device) -> None:
    with pytest.raises(ResourceError, match="enormous"):
        Buffer(device, "enormous", device.info.max_storage_bytes + 4)
    with pytest.raises(ResourceError, match="enormous"):
        TextureArray(device, "enormous", (device.info.max_texture_size + 1, 1, 1), gl.RGBA8)


def test_buffers_that_samplers_do_not_reach_are_refused(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What lies behind the last texel would be read as zeros, and no driver says so."""
    buffer = Buffer(device, "points", 1024)
    monkeypatch.setattr(device, "info", dataclasses.replace(device.info, max_buffer_texels=64))
    buffer.bind(0)
    monkeypatch.setattr(device, "info", dataclasses.replace(device.info, max_buffer_texels=63))
    with pytest.raises(ResourceError, match=r"'points': 1024 bytes exceed the 1008"):
        buffer.bind(0)
    buffer.release()


def test_gl_errors_are_raised(device: Device) -> None:
    device.raw.glEnable(0xDEAD)
    with pytest.raises(GpuError, match="GL_INVALID_ENUM"):
        device.check()
    device.check()


def test_fill_sets_every_word(device: Device) -> None:
    buffer = Buffer(device, "test", 4096)
    buffer.fill(0x7F800000)
    np.testing.assert_array_equal(buffer.read(np.uint32), np.full(1024, 0x7F800000))
    buffer.release()


def test_reading_nothing_gives_nothing(device: Device) -> None:
    buffer = Buffer.of(device, "test", np.arange(3, dtype=np.uint32))
    nothing = buffer.read(np.uint32, 0)
    assert (nothing.dtype, nothing.shape) == (np.uint32, (0,))
    device.check()
    np.testing.assert_array_equal(buffer.read(np.uint32, 2), [0, 1])
    buffer.release()


def test_stage_times_add_up_to_the_wall_clock(device: Device) -> None:
    clock = StageClock(device)
    start = time.perf_counter()
    for _ in range(2):
        with clock.stage("sleep"):
            time.sleep(0.02)
    elapsed_ms = 1000 * (time.perf_counter() - start)
    # Sleeping is never shorter than asked; the stage cannot be longer than what surrounds it.
    assert 40.0 <= clock.stages_ms["sleep"] <= elapsed_ms

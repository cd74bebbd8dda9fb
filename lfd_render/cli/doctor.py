"""`lfd-render doctor`: the GL device and what it can do, what is missing and how to mend it."""

from __future__ import annotations

import json as json_format
import os
import platform
import subprocess
import sys
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from lfd_render import __version__
from lfd_render.cli import options
from lfd_render.cli.console import print_json, print_text
from lfd_render.errors import EXIT_CODES, GpuError
from lfd_render.gpu import system

if TYPE_CHECKING:
    from lfd_render.gpu.device import Device

PACKAGES = (
    "moderngl", "glcontext", "numpy", "Pillow", "OpenImageIO", "isal", "pydantic", "fastapi"
)  # fmt: skip
# Each capability, and the extensions any one of which gives it.
CAPABILITIES = {
    "int64_atomics": ("GL_NV_shader_atomic_int64",),
    "int64": ("GL_ARB_gpu_shader_int64",),
    "subgroup": ("GL_KHR_shader_subgroup",),
    "ballot": ("GL_ARB_shader_ballot",),
    "conservative_raster": ("GL_NV_conservative_raster", "GL_INTEL_conservative_rasterization"),
    "multiview": ("GL_OVR_multiview",),
    "bindless_textures": ("GL_ARB_bindless_texture",),
}
_MAX_COMPUTE_SHARED_MEMORY_SIZE = 0x8262
_ZINK_PROBE = (
    "import json; from lfd_render.gpu.device import Device; d = Device.open('auto').info;"
    "print(json.dumps({'renderer': d.renderer, 'version': d.version,"
    " 'int64_atomics': 'GL_NV_shader_atomic_int64' in d.extensions}))"
)
_ZINK_SECONDS = 60


def doctor(device: options.DeviceOption = "auto", json: options.JsonOption = False) -> None:
    """Tell which OpenGL device is found, its limits, what is missing and how to mend it."""
    options.check_device(device)
    os.environ.setdefault("EGL_LOG_LEVEL", "fatal")  # the findings say it better
    findings = examine(device)
    if json:
        print_json(findings)
    else:
        print_text("\n".join(_lines(findings)))
    if findings["gl"] is None:
        raise typer.Exit(EXIT_CODES[GpuError])


def examine(device: str) -> dict[str, Any]:
    """All findings as plain data; ``gl`` is None where OpenGL cannot be used."""
    problem = system.gl_problem()
    gl = None
    if problem is None:
        try:
            gl = _opened(device)
        except GpuError as error:
            problem = str(error)
    return {
        "version": __version__,
        "python": platform.python_version(),
        "system": platform.platform(),
        "gl": gl,
        "problem": problem,
        "egl_devices": _egl_devices(),
        "zink": _zink() if gl else None,
        "packages": {name: _package_version(name) for name in PACKAGES},
        "advice": _advice(gl),
    }


def _opened(choice: str) -> dict[str, Any]:
    """What an opened device says of itself; raises GpuError."""
    from lfd_render.gpu.device import Device  # noqa: PLC0415 (keeps --help quick)

    device = Device.open(choice)
    try:
        info = device.info
        return {
            "renderer": info.renderer,
            "vendor": info.vendor,
            "version": info.version,
            "egl_index": info.egl_index,
            "software": info.software,
            "limits": _limits(device),
            "capabilities": {
                name: any(extension in info.extensions for extension in extensions)
                for name, extensions in CAPABILITIES.items()
            },
            "extensions": sorted(info.extensions),
        }
    finally:
        device.close()


def _limits(device: Device) -> dict[str, Any]:
    """Limits that decide how work is cut; sizes in bytes."""
    import numpy as np  # noqa: PLC0415 (keeps --help quick)

    shared = np.zeros(1, np.int32)
    device.raw.glGetIntegerv(_MAX_COMPUTE_SHARED_MEMORY_SIZE, shared.ctypes.data)
    context = device.context.info
    return {
        "storage_block_bytes": device.info.max_storage_bytes,
        "texture_units": device.info.max_texture_units,
        "array_layers": device.info.max_array_layers,
        "texture_size": device.info.max_texture_size,
        "texture_bytes": device.info.max_texture_bytes,
        "texture_budget_bytes": device.info.texture_budget_bytes,
        "work_groups": list(context["GL_MAX_COMPUTE_WORK_GROUP_COUNT"]),
        "work_group_size": list(context["GL_MAX_COMPUTE_WORK_GROUP_SIZE"]),
        "work_group_invocations": context["GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS"],
        "shared_memory_bytes": int(shared[0]),
    }


def _egl_devices() -> list[dict[str, Any]]:
    try:
        return [asdict(device) for device in system.egl_devices()]
    except OSError:
        return []


def _zink() -> dict[str, Any] | None:
    """OpenGL through zink on lavapipe, tried in a process of its own; None if not installed."""
    environment = system.zink_environment()
    if environment is None:
        return None
    command = [sys.executable, "-c", _ZINK_PROBE]
    try:
        done = subprocess.run(
            command,
            env=os.environ | environment,
            capture_output=True,
            text=True,
            timeout=_ZINK_SECONDS,
            check=True,
        )
        found: dict[str, Any] = json_format.loads(done.stdout)
        return found
    except (subprocess.SubprocessError, ValueError) as error:
        return {"renderer": None, "problem": str(error)}


def _package_version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _advice(gl: dict[str, Any] | None) -> list[str]:
    """What to do, most needed first."""
    advice = []
    if system.gl_problem():
        advice.append(f"For OpenGL: {system.advice(system.GL_PACKAGES)}")
    elif gl is None:
        advice.append(
            "OpenGL 4.5 is needed: choose another device, or update its driver "
            "(Mesa's software renderer has 4.5 since 20.3)."
        )
    if (gl is None or gl["software"]) and Path("/dev/nvidiactl").exists():
        advice.append(
            "An NVIDIA driver is loaded, but EGL offers none of its devices. In a container, set "
            "NVIDIA_DRIVER_CAPABILITIES=graphics,compute,utility and provide "
            "/usr/share/glvnd/egl_vendor.d/10_nvidia.json; elsewhere install the driver's GL part."
        )
    nodes = sorted(Path("/dev/dri").glob("renderD*"))
    if closed := [str(node) for node in nodes if not os.access(node, os.R_OK | os.W_OK)]:
        advice.append(f"{', '.join(closed)}: no permission; join the group 'render'.")
    if system.lavapipe_icd() is None:
        advice.append(
            "For tests of the 64-bit path without hardware: " + system.advice(system.ZINK_PACKAGES)
        )
    return advice


def _lines(findings: dict[str, Any]) -> list[str]:
    gl, zink = findings["gl"], findings["zink"]
    lines = [
        f"lfd-render {findings['version']}, Python {findings['python']}, {findings['system']}",
        "",
        *(_device_lines(gl) if gl else [f"OpenGL cannot be used: {findings['problem']}"]),
        "",
        "EGL devices:" if findings["egl_devices"] else "EGL devices: none",
        *(_egl_line(device) for device in findings["egl_devices"]),
    ]
    if zink:
        atomics = "with" if zink.get("int64_atomics") else "without"
        works = f"{zink['renderer']}, {atomics} 64-bit atomics"
        lines += ["", "zink: " + (works if zink["renderer"] else zink["problem"])]
    versions = (f"{name} {version or 'missing'}" for name, version in findings["packages"].items())
    lines += ["", "Packages: " + ", ".join(versions)]
    return lines + [line for advice in findings["advice"] for line in ("", advice)]


def _device_lines(gl: dict[str, Any]) -> list[str]:
    kind = "SOFTWARE rendering on the processor" if gl["software"] else "hardware"
    rows = {"vendor": gl["vendor"], "version": gl["version"], "egl_index": gl["egl_index"]}
    rows |= {name: _readable(value) for name, value in gl["limits"].items()}
    rows |= {name: "yes" if has else "no" for name, has in gl["capabilities"].items()}
    return [
        f"OpenGL device: {gl['renderer']} ({kind})",
        *(f"  {name.replace('_', ' '):<24}{value}" for name, value in rows.items()),
    ]


def _readable(value: int | list[int]) -> str:
    return " × ".join(map(str, value)) if isinstance(value, list) else str(value)


def _egl_line(device: dict[str, Any]) -> str:
    words = [device["vendor"] or "unknown vendor"]
    words += [device["drm_file"]] if device["drm_file"] else []
    words += ["software"] if device["software"] else []
    words += [] if device["usable"] else ["no working driver"]
    return f"  {device['index']}: {', '.join(words)}"

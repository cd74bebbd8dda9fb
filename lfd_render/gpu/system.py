"""What the operating system must provide: EGL with a driver, venv, and for tests lavapipe, whose
atomics have 64 bits, and Chromium.

Standard library only and nothing from the package, because `make` runs this file with the bare
system Python before the virtual environment exists: `python3 system.py gl venv zink?` installs what
is missing by apt when that is permitted, else prints the exact command and fails. A part with a
question mark is wanted but not needed.
"""

import ctypes
import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

GL_PACKAGES = ("libegl1", "libgl1", "libgl1-mesa-dri")
ZINK_PACKAGES = ("mesa-vulkan-drivers",)
BROWSER_PACKAGES = ("chromium",)
# Debian splits ensurepip off into a package for each Python version.
VENV_PACKAGES = (f"python{sys.version_info[0]}.{sys.version_info[1]}-venv",)

_ICD_FOLDERS = ("/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/etc/vulkan/icd.d")
_INSTALL = ("apt-get", "install", "-y", "--no-install-recommends")
_PATIENCE = ("-o", "DPkg::Lock::Timeout=120")  # seconds to wait for another apt to end

_EGL_VENDOR = 0x3053
_EGL_VERSION = 0x3054
_EGL_EXTENSIONS = 0x3055
_EGL_PLATFORM_DEVICE = 0x313F
_EGL_DRM_DEVICE_FILE = 0x3233
_EGL_CUDA_DEVICE = 0x323A  # EGL_NV_device_cuda
_MAX_DEVICES = 32


@dataclass(frozen=True)
class EglDevice:
    """One device as EGL lists it; ``index`` is its place in that list, which `--device` takes."""

    index: int
    vendor: str
    version: str
    drm_file: str
    software: bool
    usable: bool


def egl_devices() -> list[EglDevice]:
    """All EGL devices in EGL's order. Raises OSError when libEGL.so.1 cannot be loaded."""
    egl = _load_egl()
    return [_describe(egl, index, handle) for index, handle in enumerate(_handles(egl))]


def egl_index_of_cuda(cuda: int) -> int | None:
    """The place in EGL's list of a CUDA device, whose order differs; None where it has none."""
    egl = _load_egl()
    attribute = _extension(egl, "eglQueryDeviceAttribEXT", ctypes.c_uint, 3)
    number = ctypes.c_ssize_t()
    for index, handle in enumerate(_handles(egl)):
        # Devices that are not NVIDIA's know no such attribute.
        known = attribute and attribute(handle, _EGL_CUDA_DEVICE, ctypes.byref(number))
        if known and number.value == cuda:
            return index
    return None


def gl_problem() -> str | None:
    """Why no EGL device can be used for OpenGL here, or None when one can."""
    try:
        ctypes.CDLL("libGL.so.1")
        devices = egl_devices()
    except OSError as error:
        return str(error)
    if not any(device.usable for device in devices):
        return f"EGL lists {len(devices)} devices and none has a working driver"
    return None


def lavapipe_icd() -> Path | None:
    """The Vulkan loader's description of lavapipe, Mesa's software Vulkan, if installed."""
    found = (p for folder in _ICD_FOLDERS for p in sorted(Path(folder).glob("lvp_icd*.json")))
    return next(found, None)


def zink_environment() -> dict[str, str] | None:
    """Variables that run OpenGL through zink on lavapipe, which has 64-bit atomics.

    None when lavapipe is not installed. They act on processes started with them, not on this one.
    """
    icd = lavapipe_icd()
    if icd is None:
        return None
    return {
        "MESA_LOADER_DRIVER_OVERRIDE": "zink",
        "GALLIUM_DRIVER": "zink",
        "LIBGL_KOPPER_DRI2": "1",
        "LIBGL_ALWAYS_SOFTWARE": "1",
        "VK_ICD_FILENAMES": str(icd),
        "VK_DRIVER_FILES": str(icd),
    }


def apt_command(packages: Sequence[str]) -> str:
    """The command that a person types to install packages."""
    sudo = "sudo " if os.geteuid() != 0 and shutil.which("sudo") else ""
    return f"{sudo}apt-get update && {sudo}{shlex.join((*_INSTALL, *packages))}"


def _load_egl() -> ctypes.CDLL:
    egl = ctypes.CDLL("libEGL.so.1")
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    egl.eglGetProcAddress.argtypes = (ctypes.c_char_p,)
    egl.eglInitialize.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
    egl.eglQueryString.restype = ctypes.c_char_p
    egl.eglQueryString.argtypes = (ctypes.c_void_p, ctypes.c_int)
    return egl


def _extension(egl: ctypes.CDLL, name: str, result: Any, arguments: int) -> Any:
    """An EGL extension function whose arguments all go as pointers, or None."""
    address = egl.eglGetProcAddress(name.encode())
    if not address:
        return None
    return ctypes.CFUNCTYPE(result, *[ctypes.c_void_p] * arguments)(address)


def _handles(egl: ctypes.CDLL) -> list[int | None]:
    """What EGL calls its devices."""
    handles = (ctypes.c_void_p * _MAX_DEVICES)()
    count = ctypes.c_int(0)
    query = _extension(egl, "eglQueryDevicesEXT", ctypes.c_uint, 3)
    if query is None or not query(_MAX_DEVICES, handles, ctypes.byref(count)):
        return []
    return handles[: count.value]


def _describe(egl: ctypes.CDLL, index: int, handle: int | None) -> EglDevice:
    device_string = _extension(egl, "eglQueryDeviceStringEXT", ctypes.c_char_p, 2)
    platform_display = _extension(egl, "eglGetPlatformDisplayEXT", ctypes.c_void_p, 3)

    extensions = (device_string(handle, _EGL_EXTENSIONS) if device_string else b"") or b""
    drm_file = b""
    if b"EGL_EXT_device_drm" in extensions.split():
        drm_file = device_string(handle, _EGL_DRM_DEVICE_FILE) or b""

    display = platform_display(_EGL_PLATFORM_DEVICE, handle, None) if platform_display else None
    usable = bool(display) and bool(egl.eglInitialize(display, None, None))
    vendor = egl.eglQueryString(display, _EGL_VENDOR) if usable else b""
    version = egl.eglQueryString(display, _EGL_VERSION) if usable else b""
    return EglDevice(
        index=index,
        vendor=(vendor or b"").decode(errors="replace"),
        version=(version or b"").decode(errors="replace"),
        drm_file=drm_file.decode(errors="replace"),
        software=b"EGL_MESA_device_software" in extensions.split(),
        usable=usable,
    )


def _venv_problem() -> str | None:
    # Without ensurepip, a pip beside the interpreter can still fill an environment.
    if importlib.util.find_spec("ensurepip") or importlib.util.find_spec("pip"):
        return None
    return f"{sys.executable} has neither ensurepip nor pip"


def _zink_problem() -> str | None:
    return None if lavapipe_icd() else "lavapipe, Mesa's software Vulkan, is not installed"


def browser_path() -> str | None:
    """Chromium's program, which Debian calls chromium and others otherwise."""
    names = ("chromium", "chromium-browser", "google-chrome-stable")
    return next((path for name in names if (path := shutil.which(name))), None)


def browser_problem() -> str | None:
    """Why the page cannot be tried here, or None when it can."""
    return None if browser_path() else "chromium is not installed"


PARTS = {
    "gl": (gl_problem, GL_PACKAGES),
    "venv": (_venv_problem, VENV_PACKAGES),
    "zink": (_zink_problem, ZINK_PACKAGES),
    "browser": (browser_problem, BROWSER_PACKAGES),
}


def _privilege() -> list[str] | None:
    """What to put before a command so that it runs as root without asking; None if nothing can."""
    if not shutil.which("apt-get"):
        return None
    if os.geteuid() == 0:
        return []
    sudo = ["sudo", "-n"]
    permitted = shutil.which("sudo") and _run([*sudo, "true"])
    return sudo if permitted else None


def _run(command: Sequence[str], errors: bool = False) -> bool:
    """Run a command without input; whether it succeeded. Of its output only errors may show."""
    stderr = None if errors else subprocess.DEVNULL
    done = subprocess.run(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=stderr, check=False
    )
    return done.returncode == 0


def _install(packages: Sequence[str], privilege: Sequence[str]) -> bool:
    """Install by apt; the package lists are fetched only when they lack a package or are stale."""
    apt = [*privilege, "env", "DEBIAN_FRONTEND=noninteractive"]
    install = [*apt, *_INSTALL, *_PATIENCE, *packages]
    update = [*apt, "apt-get", "update", *_PATIENCE]
    return _run(install) or (_run(update, errors=True) and _run(install, errors=True))


def advice(packages: Sequence[str]) -> str:
    """What a person does to get packages, on this system."""
    if shutil.which("apt-get"):
        who = "" if os.geteuid() == 0 or shutil.which("sudo") else "as root "
        return f"Install it {who}with:\n  {apt_command(packages)}"
    if platform.system() == "Darwin":
        return "macOS stops at OpenGL 4.1, without compute shaders: use a Linux machine."
    return f"Install what Debian calls {' '.join(packages)} with this system's package manager."


def main(requests: Sequence[str]) -> int:
    """Provide each requested part; exit status 1 when a needed one is still missing."""
    missing = _missing(requests)
    privilege = _privilege() if missing else None
    if privilege is not None:
        # Each wanted part by itself: one that this system lacks must not keep the rest away.
        needed = [part for part in missing if part in requests]
        groups = [needed, *([part] for part in missing if part not in requests)]
        done = [_provide(group, privilege) for group in groups if group]
        if any(done):
            # A fresh process, because this one's loader remembers which libraries were missing.
            return int(not _run([sys.executable, __file__, "--check", *requests], errors=True))
    return _report(missing, requests)


def _provide(parts: Sequence[str], privilege: Sequence[str]) -> bool:
    packages = _packages(parts)
    print(f"Installing system packages: {' '.join(packages)}", file=sys.stderr, flush=True)
    return _install(packages, privilege)


def _missing(requests: Sequence[str]) -> dict[str, str]:
    """What is wrong with each requested part that is not there."""
    parts = [request.removesuffix("?") for request in requests]
    return {part: problem for part in parts if (problem := PARTS[part][0]())}


def _packages(parts: Iterable[str]) -> list[str]:
    return [package for part in parts for package in PARTS[part][1]]


def _report(missing: dict[str, str], requests: Sequence[str]) -> int:
    """Say what is missing and how to mend it; 1 when something needed is."""
    for part, problem in missing.items():
        print(f"{part} is missing: {problem}", file=sys.stderr)
    if missing:
        print(advice(_packages(missing)), file=sys.stderr)
    return int(any(part in requests for part in missing))


if __name__ == "__main__":
    os.environ.setdefault("EGL_LOG_LEVEL", "fatal")  # what is missing is said once, below
    if sys.argv[1] == "--check":
        sys.exit(_report(_missing(sys.argv[2:]), sys.argv[2:]))
    sys.exit(main(sys.argv[1:]))

"""Calibrations of displays that are plugged in: a Looking Glass shows a drive with its own.

The drive holds `LKG_calibration/visual.json`. Where the system mounts drives is searched, or the
folders in the environment variable LFD_CALIBRATION_ROOTS, separated as PATH is.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from lfd_render.errors import ProfileError

ROOTS_VARIABLE = "LFD_CALIBRATION_ROOTS"
CALIBRATION = Path("LKG_calibration") / "visual.json"
_MOUNTS = ("media/*/*", "media/*", "run/media/*/*", "mnt/*", "Volumes/*")


def search_roots() -> list[Path]:
    """Folders that may be such a drive."""
    named = os.environ.get(ROOTS_VARIABLE)
    if named is not None:
        return [Path(folder) for folder in named.split(os.pathsep) if folder]
    return [folder for pattern in _MOUNTS for folder in sorted(Path("/").glob(pattern))]


def mounted_calibrations(roots: Sequence[Path] | None = None) -> list[Path]:
    """Calibration files below the folders, or below those of `search_roots`; sorted, each once."""
    found: dict[Path, Path] = {}
    for root in search_roots() if roots is None else roots:
        path = root / CALIBRATION
        try:
            if path.is_file():
                found.setdefault(path.resolve(), path)
        except OSError:
            continue  # a drive that may not be read or has gone
    return sorted(found.values())


def the_mounted_calibration() -> Path:
    """The one calibration there is. Raises ProfileError for none and for several."""
    found = mounted_calibrations()
    if len(found) == 1:
        return found[0]
    if found:
        listed = ", ".join(map(str, found))
        raise ProfileError(f"display auto: {len(found)} calibrations: {listed}; give one of them")
    where = os.environ.get(ROOTS_VARIABLE) or "the mounted drives"
    raise ProfileError(
        f"display auto: no {CALIBRATION} in {where}; plug the display in and mount its drive, set "
        f"{ROOTS_VARIABLE}, or name a profile"
    )

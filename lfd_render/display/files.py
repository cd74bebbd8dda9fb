"""Writing files so that a reader sees the whole file or none."""

import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lfd_render.errors import OutputError


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary name beside `path`; on success it takes the place of `path`.

    On any failure the temporary file is removed and `path` stays as it was. Operating
    system errors become an OutputError naming the file.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise OutputError(
            f"{path}: is a device or a pipe, which no file may replace; use - or a file"
        )
    temporary = path.with_name(f".{path.name[:100]}.{uuid.uuid4().hex}.part")
    try:
        yield temporary
        os.replace(temporary, path)
    except (OSError, ValueError) as cause:
        # A null byte in the name is a ValueError.
        reason = (isinstance(cause, OSError) and cause.strerror) or str(cause)
        raise OutputError(
            f"{path}: cannot be written: {reason}; choose a file in an existing, writable folder"
        ) from cause
    finally:
        _remove(temporary)


def _remove(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except (OSError, ValueError):
        return  # the error that left it behind is already on its way

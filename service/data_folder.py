"""The folder in which a server keeps what it was given."""

from __future__ import annotations

import fcntl
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lfd_render.errors import OutputError


@contextmanager
def data_folder(given: str | None) -> Iterator[Path]:
    """The folder of LFD_DATA_DIR, this server's alone meanwhile, or one that goes in the end.

    Raises OutputError for a folder that cannot be had.
    """
    if given is None:
        with tempfile.TemporaryDirectory(prefix="lfd-render-") as temporary:
            yield Path(temporary)
        return
    folder = Path(given)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = (folder / ".lock").open("w")
    except OSError as error:
        raise OutputError(
            f"LFD_DATA_DIR: {given}: {error.strerror}; give a folder that can be written"
        ) from error
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise OutputError(
                f"LFD_DATA_DIR: {given}: another server uses it; give each its own"
            ) from error
        yield folder

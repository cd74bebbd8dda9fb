"""Where results go: checked before any rendering, written whole or not at all."""

import os
import re
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from lfd_render.cli.console import warn, writing_stdout
from lfd_render.errors import OutputError, UsageError

STDOUT = "-"


def check_picture_output(
    output: str, json: bool = False, formats: Sequence[str] = ("png",), asked: str | None = None
) -> str:
    """The format of a picture that goes to this file, or to stdout: the one asked for, else what
    the name ends in, else the first. Raises before work starts if it cannot be written there.

    OutputError for a place that cannot be written, UsageError for a name that makes no sense.
    """
    if output == STDOUT:
        if json:
            raise UsageError("-o -: stdout carries either the picture or --json's object; drop one")
        if sys.stdout.isatty():
            raise UsageError("-o -: stdout is a terminal; send the picture to a file or a pipe")
        return asked or formats[0]
    path = Path(output)
    if path.is_dir():
        raise OutputError(f"{output}: is a folder; give a file name")
    if path.exists() and not path.is_file():
        raise OutputError(f"{output}: is a device or a pipe; give a file name, or - for stdout")
    named = path.suffix.lower()[1:]
    if asked is None and named not in formats:
        known = " or ".join(f".{name}" for name in formats)
        raise UsageError(f"{output}: suffix '{path.suffix}'; give {known}, or - for stdout")
    _check_folder(path.parent)
    return asked or named


def check_folder_output(output: str) -> Path:
    """The folder for results, which need not exist while the one above it can be written.

    Raises OutputError. Nothing is made yet, so that a failure leaves nothing behind.
    """
    if output == STDOUT:
        raise UsageError("-o -: the result is several files; give a folder")
    folder = Path(output)
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{output}: is a file; give a folder")
    _check_folder(folder if folder.exists() else folder.absolute().parent)
    return folder


def make_folder(folder: Path) -> None:
    """Make the folder if it is not there; raises OutputError."""
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: {error.strerror}; choose another folder") from error


@contextmanager
def filling(folder: Path) -> Iterator[Path]:
    """Give a temporary folder whose files all move into `folder` in the end, or none on failure.

    Makes `folder` if it is not there, and removes it again on failure. Raises OutputError.
    """
    made = not folder.exists()
    make_folder(folder)
    try:
        with tempfile.TemporaryDirectory(prefix=".lfd-render-", dir=folder) as name:
            yield Path(name)
            for file in sorted(Path(name).iterdir()):
                os.replace(file, folder / file.name)
    except BaseException as error:
        if made:
            _remove_empty(folder)
        if isinstance(error, OSError):
            raise OutputError(f"{folder}: {error.strerror}; choose another folder") from error
        raise


def remove_others(folder: Path, written: Sequence[Path], what: str = "view") -> None:
    """Remove views, or other numbered pictures, of an earlier run, which are not among those
    written, and say so; with views also what `unweave` wrote about its own."""
    named = re.compile(rf"{what}_(\d{{3,}}|r\d{{2,}}_c\d{{3,}})\.png")
    older = [f for f in folder.iterdir() if named.fullmatch(f.name) and f not in written]
    for file in older:
        file.unlink(missing_ok=True)
    if older:
        warn(f"{folder}: {len(older)} {what}s of an earlier run, with more {what}s, are removed")
    about = folder / "views.json"
    if what == "view" and about not in written and about.exists():
        about.unlink()
        warn(f"{about}: tells of the views that were here before, and is removed")


def _remove_empty(folder: Path) -> None:
    try:
        folder.rmdir()
    except OSError:
        return  # someone else has put something there


def write_picture(output: str, save: Callable[[Path], object]) -> None:
    """Let `save` write the picture's file, or send that file to stdout."""
    if output != STDOUT:
        save(Path(output))
        return
    with tempfile.TemporaryDirectory(prefix="lfd-render-") as folder:
        file = Path(folder) / "picture"
        save(file)
        with file.open("rb") as picture, writing_stdout():
            shutil.copyfileobj(picture, sys.stdout.buffer)


def _check_folder(folder: Path) -> None:
    """Raise OutputError unless a file can be made in the folder."""
    if not folder.is_dir():
        raise OutputError(f"{folder}: no such folder; make it first, or choose another")
    try:
        # Asking for permissions would miss read-only and full file systems.
        descriptor, name = tempfile.mkstemp(prefix=".lfd-render-", dir=folder)
    except OSError as error:
        raise OutputError(
            f"{folder}: {error.strerror}; choose a folder that can be written"
        ) from error
    os.close(descriptor)
    os.unlink(name)

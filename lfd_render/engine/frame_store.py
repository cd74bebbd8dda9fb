"""Where a sequence's frames go, so that a run that was ended anywhere goes on from there.

In a folder a frame is written under a hidden name that holds its hash, told of in the manifest, and
renamed: wherever that ends, what was written whole is found by the next run, and nothing else is.
"""

from __future__ import annotations

import fcntl
import hashlib
import importlib.util
import os
import re
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

from lfd_render.display.files import replacing
from lfd_render.engine.manifest import MANIFEST, Manifest, frame_line
from lfd_render.errors import LfdError, OptionError, OutputError

Body = bytes | memoryview
_SAVED_EVERY_S = 5.0  # the manifest of an object store, which takes no appended lines
_UNFINISHED = re.compile(r"\.(frame_[^/]+)\.([0-9a-f]{64})\.part")
_AGAIN = "the frames that were finished are kept, --resume makes the others"


class FrameStore(Protocol):
    """Frames by name. Entering reads the manifest or refuses the place, without a change there."""

    @property
    def url(self) -> str | None:
        """Where render processes elsewhere may write; None: nowhere, put does."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...

    def check(self, settings: Mapping[str, Any]) -> None:
        """Raise OutputError where settings differ from those of the frames that are there."""

    def begin(self, settings: Mapping[str, Any]) -> None:
        """Make the place and its manifest if they are not there; raises OutputError."""

    def finished(self, names: Iterable[str], done: Callable[[float], None]) -> Finished:
        """Which of these frames are there and have their hash."""

    def put(self, name: str, body: Body) -> None:
        """Keep a frame. Raises OutputError."""

    def note(self, name: str, sha256: str) -> None:
        """Tell of a frame that was written elsewhere. Raises OutputError."""


class Finished:
    """Frames that are right, and those that have another hash or are told of but gone."""

    def __init__(self) -> None:
        self.right: list[str] = []
        self.broken: list[str] = []

    def sort(self, name: str, expected: str | None, found: str | None) -> None:
        """Take a frame with its hash as told, and as it is."""
        if expected is not None and found == expected:
            self.right.append(name)
        elif expected is not None or found is not None:
            self.broken.append(name)


def frame_store(output: str, resume: bool) -> FrameStore:
    """The store in a folder, or behind a URL that fsspec knows. Raises OptionError, OutputError."""
    return UrlStore(output, resume) if "://" in output else FolderStore(Path(output), resume)


class FolderStore:
    """Frames in a folder, this run's alone meanwhile."""

    url: str | None = None

    def __init__(self, folder: Path, resume: bool) -> None:
        self._folder, self._resume = folder, resume
        self._path = folder / MANIFEST
        self._manifest: Manifest | None = None
        self._file: int | None = None

    def __enter__(self) -> Self:
        if self._path.exists():
            _refuse_unless(self._resume, str(self._folder))
            self._open()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._file is not None:
            os.close(self._file)

    def check(self, settings: Mapping[str, Any]) -> None:
        """As FrameStore has it."""
        if self._manifest:
            self._manifest.check(settings)

    def begin(self, settings: Mapping[str, Any]) -> None:
        """As FrameStore has it."""
        if self._manifest is None:
            manifest = Manifest(str(self._path), dict(settings))
            with _writing(self._folder):
                self._folder.mkdir(exist_ok=True)
                with replacing(self._path) as temporary:
                    temporary.write_text(manifest.head(), "utf-8")
            self._open()
        self._adopt()

    def finished(self, names: Iterable[str], done: Callable[[float], None]) -> Finished:
        """As FrameStore has it."""
        assert self._manifest
        found, names = Finished(), list(names)
        for index, name in enumerate(names):
            done(index / len(names))
            found.sort(name, self._manifest.hashes.get(name), _file_hash(self._folder / name))
        return found

    def put(self, name: str, body: Body) -> None:
        """As FrameStore has it."""
        sha256 = _hash(body)
        temporary = self._folder / f".{name}.{sha256}.part"
        try:
            with _writing(self._folder / name):
                with temporary.open("wb") as file:
                    file.write(body)
                self._append(name, sha256)
                os.replace(temporary, self._folder / name)
        except LfdError:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)
            raise

    def note(self, name: str, sha256: str) -> None:
        """As FrameStore has it."""
        raise AssertionError("frames come to a folder by put")

    def _open(self) -> None:
        """Read the manifest, and keep it to this run."""
        with _writing(self._path):
            self._file = os.open(self._path, os.O_RDWR | os.O_APPEND | os.O_CLOEXEC)
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise OutputError(
                f"{self._folder}: another run writes here; wait for it, or choose another folder"
            ) from error
        data = self._path.read_bytes()
        self._manifest = Manifest.parse(data.decode(errors="replace"), str(self._path))

    def _adopt(self) -> None:
        """Finish what a run that was ended had written whole, and remove what it had not."""
        assert self._file is not None
        with _writing(self._folder):
            # A line that was cut off would spoil the one that follows it.
            os.ftruncate(self._file, self._path.read_bytes().rfind(b"\n") + 1)
            for path in self._folder.iterdir():
                if not (match := _UNFINISHED.fullmatch(path.name)):
                    continue
                name, sha256 = match.groups()
                if _file_hash(path) == sha256:
                    self._append(name, sha256)
                    os.replace(path, self._folder / name)
                else:
                    path.unlink()

    def _append(self, name: str, sha256: str) -> None:
        assert self._manifest
        assert self._file is not None
        if self._manifest.hashes.get(name) != sha256:
            line = frame_line(name, sha256).encode()
            if os.write(self._file, line) < len(line):
                raise OSError(0, "no room for the manifest's line")
            self._manifest.hashes[name] = sha256


class UrlStore:
    """Frames behind a URL of fsspec, whose writes are seen whole or not at all. A manifest there
    cannot be appended to, so it is written anew every few seconds, and frames that it does not tell
    of yet are made again."""

    def __init__(self, url: str, resume: bool) -> None:
        if importlib.util.find_spec("fsspec") is None:
            raise OptionError(
                "output", f"'{url}': URLs need fsspec; pip install 'lfd-render[ray]', or a folder"
            )
        self.url: str | None = url.rstrip("/")
        self._resume = resume
        self._manifest: Manifest | None = None
        self._saved = time.monotonic()

    def __enter__(self) -> Self:
        text = _read_object(self._at(MANIFEST))
        if text is not None:
            _refuse_unless(self._resume, str(self.url))
            self._manifest = Manifest.parse(text.decode(errors="replace"), self._at(MANIFEST))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._manifest and self._manifest.hashes:
            self._save()

    def check(self, settings: Mapping[str, Any]) -> None:
        """As FrameStore has it."""
        if self._manifest:
            self._manifest.check(settings)

    def begin(self, settings: Mapping[str, Any]) -> None:
        """As FrameStore has it."""
        if self._manifest is None:
            self._manifest = Manifest(self._at(MANIFEST), dict(settings))
            self._save()

    def finished(self, names: Iterable[str], done: Callable[[float], None]) -> Finished:
        """As FrameStore has it."""
        assert self._manifest
        found, names = Finished(), list(names)
        for index, name in enumerate(names):
            done(index / len(names))
            if (expected := self._manifest.hashes.get(name)) is not None:
                body = _read_object(self._at(name))
                found.sort(name, expected, None if body is None else _hash(body))
        return found

    def put(self, name: str, body: Body) -> None:
        """As FrameStore has it."""
        assert self.url
        self.note(name, put_object(self.url, name, body))

    def note(self, name: str, sha256: str) -> None:
        """As FrameStore has it."""
        assert self._manifest
        self._manifest.hashes[name] = sha256
        if time.monotonic() - self._saved > _SAVED_EVERY_S:
            self._save()

    def _at(self, name: str) -> str:
        return f"{self.url}/{name}"

    def _save(self) -> None:
        assert self.url
        assert self._manifest
        put_object(self.url, MANIFEST, self._manifest.text().encode())
        self._saved = time.monotonic()


def put_object(url: str, name: str, body: Body) -> str:
    """Write a file below a URL, whole or not at all; its SHA-256. Raises OutputError."""
    import fsspec  # noqa: PLC0415 (an extra)

    sha256 = _hash(body)
    try:
        # Outside of a transaction fsspec opens local files in place.
        folders = {"auto_mkdir": True} if url.startswith(("file:", "local:")) else {}
        system, path = fsspec.url_to_fs(f"{url}/{name}", **folders)
        with system.transaction, system.open(path, "wb") as file:
            file.write(body)
    except Exception as error:  # whatever the object store's client raises
        raise OutputError(f"{url}/{name}: cannot be written: {error}; {_AGAIN}") from error
    return sha256


def _read_object(url: str) -> bytes | None:
    """The bytes behind a URL; None where there are none. Raises OutputError."""
    import fsspec  # noqa: PLC0415 (an extra)

    try:
        with fsspec.open(url, "rb") as file:
            data: bytes = file.read()
            return data
    except FileNotFoundError:
        return None
    except Exception as error:  # whatever the object store's client raises
        raise OutputError(f"{url}: cannot be read: {error}; give a URL that fsspec opens") from None


def _refuse_unless(resume: bool, place: str) -> None:
    if not resume:
        raise OutputError(
            f"{place}: holds a sequence already; --resume goes on with it, or choose another folder"
        )


def _hash(body: Body) -> str:
    return hashlib.sha256(body).hexdigest()


def _file_hash(path: Path) -> str | None:
    """SHA-256 of a file, None where there is none. Raises OutputError."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise OutputError(f"{path}: cannot be read: {error.strerror}; mend or remove it") from error


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Turn what the operating system says into an OutputError about a path."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror}; {_AGAIN}") from error

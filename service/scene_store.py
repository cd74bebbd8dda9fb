"""Uploaded scenes on disk, under ids made of their content."""

from __future__ import annotations

import hashlib
import json
import logging
import math
import shutil
import time
import uuid
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Annotated, Any

from pydantic import BaseModel, Field

from lfd_render.engine.jobs import SceneSource
from lfd_render.errors import SceneError
from lfd_render.scene.builtin import PREFIX, parse_builtin

from .problems import ProblemError
from .settings import Settings

_log = logging.getLogger("lfd_render.service")

SUFFIXES = (".glb", ".gltf", ".obj")
_MOST_FILES = 512
_MOST_PARTS = 8  # folders deep
FORM_BYTES = 1 << 20  # what headers of a form's parts may take besides the files


class SceneAnswer(BaseModel):
    """A scene that the server has. created: seconds since 1970; None for built-in scenes, of which
    the rest is known when they are rendered."""

    id: str = Field(examples=["builtin:spheres"])
    main: str = Field(description="The file that is the scene.")
    created: float | None = None
    files: dict[str, int] = Field(default_factory=dict, description="Bytes by name.")
    triangles: int | None = None
    meshes: int | None = None
    materials: int | None = None
    images: int | None = None
    lights: int | None = None
    cameras: list[str] = Field(default_factory=list, description="Names for `camera`.")
    bounds: Annotated[list[list[float]], Field(min_length=2, max_length=2)] | None = Field(
        None, description="Lowest and highest corner of the scene's box."
    )
    bytes: int | None = Field(None, description="What it takes in memory.")
    warnings: list[str] = Field(default_factory=list)


@dataclass(frozen=True)
class StoredScene:
    """An uploaded scene. main: the file that is the scene; facts: what a render process found.

    Raises ValidationError, a ValueError, for what another version may have written."""

    id: str
    main: str
    files: dict[str, int]  # bytes by relative name
    created: float  # seconds since 1970
    facts: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _ = self.described

    @cached_property
    def described(self) -> SceneAnswer:
        """As answers tell of it."""
        return SceneAnswer.model_validate(self.facts | asdict(self))


class Upload:
    """A scene on its way in: files are written below a folder of its own."""

    def __init__(self, folder: Path, most_bytes: int) -> None:
        self.folder = folder
        self._most_bytes = most_bytes
        self._left = most_bytes
        self._hashes: dict[str, str] = {}
        self.files: dict[str, int] = {}

    @contextmanager
    def file(self, name: str) -> Iterator[_Sink]:
        """Where a file's bytes go. Raises ProblemError for a name that leads elsewhere."""
        confined(name)
        if name in self.files:
            raise ProblemError(422, f"files: '{name}' is there twice; give it once", "files")
        if len(self.files) >= _MOST_FILES:
            raise ProblemError(413, f"files: more than {_MOST_FILES}; give fewer", "files")
        path = self.folder / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            stream = path.open("wb")
        except (FileExistsError, NotADirectoryError, IsADirectoryError):
            raise ProblemError(
                422, f"files: '{name}' is a file and a folder; rename one", "files"
            ) from None
        with stream:
            sink = _Sink(self, stream)
            yield sink
        self.files[name] = sink.bytes
        self._hashes[name] = sink.digest.hexdigest()

    def take(self, count: int) -> None:
        """Count bytes against the limit. Raises ProblemError 413."""
        self._left -= count
        if self._left < 0:
            raise too_large(self._most_bytes)

    def main(self, asked: str | None) -> str:
        """The file that is the scene: the one asked for, else the only one that can be."""
        if asked is not None:
            if asked not in self.files:
                raise ProblemError(422, f"main: '{asked[:100]}' is none of the files", "main")
            return asked
        scenes = [name for name in self.files if name.lower().endswith(SUFFIXES)]
        if len(scenes) != 1:
            found = ", ".join(scenes) or "none"
            raise ProblemError(
                422,
                f"files: {found[:200]} of them is a scene; give one {', '.join(SUFFIXES)}, or name "
                "it in main",
                "files",
            )
        return scenes[0]

    def id(self, main: str) -> str:
        """What names this content."""
        told = json.dumps([main, sorted(self._hashes.items())])
        return hashlib.sha256(told.encode()).hexdigest()[:40]


class _Sink:
    """A file being written, counted and hashed."""

    def __init__(self, upload: Upload, stream: Any) -> None:
        self._upload, self._stream = upload, stream
        self.digest = hashlib.sha256()
        self.bytes = 0

    def write(self, data: bytes) -> None:
        """Add bytes."""
        self._upload.take(len(data))
        self.digest.update(data)
        self.bytes += len(data)
        self._stream.write(data)


def too_large(most_bytes: int) -> ProblemError:
    """The problem of a body that is too large."""
    return ProblemError(413, f"body: more than {most_bytes} bytes; give a smaller one", "body")


def confined(name: str) -> None:
    """Raise ProblemError unless a name is relative, plain and leads into no other folder."""
    parts = PurePosixPath(name).parts
    odd = any(not c.isprintable() or c in '\\:*?"<>|' for c in name)
    if (
        not parts
        or odd
        or name.startswith("/")
        or any(part in (".", "..") or len(part.encode()) > 200 for part in name.split("/"))
        or "" in name.split("/")
        or len(parts) > _MOST_PARTS
    ):
        raise ProblemError(
            422, f"files: '{name[:100]}'; give a relative name, as textures/wood.png", "files"
        )


class SceneStore:
    """Scenes below a folder: ``<id>/scene.json`` tells of one, ``<id>/files/`` holds its files.

    A scene that is deleted while pictures of it are made stays on disk until they are done.
    """

    def __init__(self, folder: Path, settings: Settings) -> None:
        self._folder = folder
        self._settings = settings
        self._leases: Counter[str] = Counter()
        folder.mkdir(parents=True, exist_ok=True)
        for left in folder.glob(".*"):  # of a server that was ended
            shutil.rmtree(left, ignore_errors=True)
        self._scenes: dict[str, StoredScene] = {}
        for left in folder.iterdir():
            scene = _read(left)
            if scene and scene.id == left.name:
                self._scenes[scene.id] = scene
            elif _is_bare(left):  # of a server that was ended while it deleted it
                shutil.rmtree(left, ignore_errors=True)
            else:
                _log.warning("scene cannot be read and is left alone", extra={"folder": left.name})
        self._gone: dict[str, Path] = {}  # deleted, still leased
        self._coming: list[int] = []  # bytes that uploads may bring

    def all(self) -> list[StoredScene]:
        """All of them, the newest first."""
        return sorted(self._scenes.values(), key=lambda scene: -scene.created)

    def get(self, scene_id: str) -> StoredScene:
        """The scene of an id. Raises ProblemError 404."""
        try:
            return self._scenes[scene_id]
        except KeyError:
            raise ProblemError(
                404, f"scene '{scene_id[:100]}': unknown; upload it to /v1/scenes", "scene"
            ) from None

    @contextmanager
    def source(self, scene_id: str) -> Iterator[SceneSource]:
        """Where a scene is read from, which stays there meanwhile. Raises ProblemError 404."""
        if scene_id.startswith(PREFIX):
            yield _builtin(scene_id, self._settings)
            return
        scene = self.get(scene_id)
        self._leases[scene_id] += 1
        try:
            yield self._source(scene.id, self._folder / scene.id / "files" / scene.main)
        finally:
            self._leases[scene_id] -= 1
            if not self._leases[scene_id]:
                del self._leases[scene_id]
                if scene_id in self._gone:
                    shutil.rmtree(self._gone.pop(scene_id), ignore_errors=True)

    def delete(self, scene_id: str) -> None:
        """Forget a scene. Raises ProblemError 404."""
        self.get(scene_id)
        del self._scenes[scene_id]
        folder = self._folder / scene_id
        if self._leases[scene_id]:
            self._gone[scene_id] = folder
            (folder / "scene.json").unlink(missing_ok=True)
        else:
            gone = self._folder / f".{uuid.uuid4().hex}"
            folder.rename(gone)  # at once, whenever the server is ended
            shutil.rmtree(gone, ignore_errors=True)

    @contextmanager
    def upload(self, length: int | None) -> Iterator[Upload]:
        """A place for a new scene's files, removed unless it is added. length: of the body, if it
        is known. Raises ProblemError when there is no room, before any of it is read."""
        settings = self._settings
        count = settings.upload_bytes if length is None else length
        if len(self._coming) >= settings.max_uploads:
            raise ProblemError(
                429, f"{len(self._coming)} scenes are being uploaded; ask again in 10 s", None,
                {"Retry-After": "10"},
            )  # fmt: skip
        if not self._is_room(count) and not self._may_be_kept(length):
            raise self._full()
        folder = self._folder / f".{uuid.uuid4().hex}"
        self._coming.append(count)
        try:
            (folder / "files").mkdir(parents=True)
            yield Upload(folder / "files", settings.upload_bytes)
        finally:
            self._coming.remove(count)
            shutil.rmtree(folder, ignore_errors=True)

    def _is_room(self, count: int) -> bool:
        """Whether one scene more may be kept, of so many bytes besides those that are coming."""
        settings = self._settings
        total = self._held() + sum(self._coming) + count
        return len(self._scenes) < settings.max_scenes and total <= settings.max_scenes_mb << 20

    def _held(self) -> int:
        return sum(sum(scene.files.values()) for scene in self._scenes.values())

    def _may_be_kept(self, length: int | None) -> bool:
        """Whether a body of this length, alone or as a form, may be of a scene that is there."""
        sizes = (sum(scene.files.values()) for scene in self._scenes.values())
        return length is not None and any(0 <= length - size <= FORM_BYTES for size in sizes)

    def _full(self) -> ProblemError:
        return ProblemError(
            507, f"{len(self._scenes)} scenes of {self._held()} bytes are kept, and "
            f"{sum(self._coming)} bytes are coming; delete one first", "scenes",
        )  # fmt: skip

    def candidate(self, upload: Upload, main: str) -> SceneSource:
        """An upload as a scene to look into, before it is added."""
        return self._source(upload.id(main), upload.folder / main)

    def add(self, upload: Upload, main: str, facts: dict[str, Any]) -> tuple[StoredScene, bool]:
        """Keep an upload; the scene, and whether it is new. Another may have come first."""
        scene = StoredScene(upload.id(main), main, upload.files, time.time(), facts)
        if scene.id in self._scenes:
            return self._scenes[scene.id], False
        if not self._is_room(0):
            raise self._full()
        (upload.folder.parent / "scene.json").write_text(json.dumps(asdict(scene)), "utf-8")
        gone = self._gone.pop(scene.id, None)
        if gone is None:
            shutil.rmtree(self._folder / scene.id, ignore_errors=True)  # where it cannot be read
            upload.folder.parent.rename(self._folder / scene.id)
        else:  # it has come back before its last picture was done
            (upload.folder.parent / "scene.json").rename(gone / "scene.json")
        self._scenes[scene.id] = scene
        return scene, True

    def _source(self, scene_id: str, path: Path) -> SceneSource:
        return SceneSource(scene_id, str(path), path.name, self._settings.limits)


def _builtin(scene_id: str, settings: Settings) -> SceneSource:
    try:
        _, options = parse_builtin(scene_id)
    except SceneError as error:
        raise ProblemError(404, f"scene '{scene_id[:100]}': {error}", "scene") from None
    limits = {"triangles": settings.max_triangles, "textures": math.isqrt(settings.max_texels)}
    for name, most in limits.items():
        if options.get(name, 0) > most:
            raise ProblemError(413, f"scene '{scene_id}': {name} is above {most}", "scene")
    return SceneSource(scene_id, scene_id, scene_id)


def _is_bare(folder: Path) -> bool:
    """Whether nothing tells of a scene there, readable or not."""
    try:
        (folder / "scene.json").lstat()
    except FileNotFoundError:
        return True
    except OSError:
        return False
    return False


def _read(folder: Path) -> StoredScene | None:
    try:
        data = json.loads((folder / "scene.json").read_text("utf-8"))
        return StoredScene(**data)
    except (OSError, ValueError, TypeError):
        return None

"""Reading the files a scene is made of: data URIs and files inside its own folder, nothing else."""

from __future__ import annotations

import binascii
import os
import re
from pathlib import Path, PurePosixPath
from urllib.parse import unquote, unquote_to_bytes

from lfd_render.errors import ResourceError, SceneError
from lfd_render.scene.limits import LoadLimits

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")
_NEIGHBOURS_ONLY = "give a data URI or a file inside the scene's folder"


class SceneFiles:
    """The folder of one scene and the cap on what is read from it."""

    def __init__(self, scene: Path, limits: LoadLimits) -> None:
        self._scene = scene
        self._limits = limits

    def scene_bytes(self) -> bytes:
        """The scene file itself."""
        return self._read(self._scene, "file")

    def read(self, uri: str, field: str) -> bytes:
        """The bytes behind a URI; `field` names its place in error messages."""
        if uri.startswith("data:"):
            return self._decode_data(uri, field)
        return self._read(self._resolve(unquote(uri), field), f"{field}: '{_shorten(uri)}'")

    def read_name(self, name: str, field: str) -> bytes:
        """The bytes of a file in the scene's folder, by a plain name instead of a URI."""
        return self._read(self._resolve(name, field), f"{field}: '{_shorten(name)}'")

    def has_name(self, name: str, field: str) -> bool:
        """Whether there is such a file; raises SceneError when the name leads elsewhere."""
        return os.path.exists(self._resolve(name, field))  # unlike Path's, never raises

    def _resolve(self, name: str, field: str) -> Path:
        """The file of a relative name, refused when it leads out of the scene's folder."""
        parts = PurePosixPath(name).parts
        outside = name.startswith("/") or ".." in parts or "\\" in name or "\0" in name
        if not parts or outside or _SCHEME.match(name):
            raise SceneError(f"{field}: '{_shorten(name)}'; {_NEIGHBOURS_ONLY}")
        folder = self._scene.parent.resolve()
        try:
            path = (folder / name).resolve()
        except (OSError, RuntimeError) as error:  # a link that leads to itself
            raise SceneError(f"{field}: '{_shorten(name)}': {error}; {_NEIGHBOURS_ONLY}") from None
        if not path.is_relative_to(folder):
            raise SceneError(
                f"{field}: '{_shorten(name)}' is a link out of the folder; {_NEIGHBOURS_ONLY}"
            )
        return path

    def _read(self, path: Path, label: str) -> bytes:
        try:
            # Asking first keeps pipes and devices, which may never end, from being opened.
            if path.exists() and not path.is_file():
                raise SceneError(f"{label}: not a regular file; give a file")
            self._check_size(path.stat().st_size, label)
            data = path.read_bytes()
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise SceneError(
                f"{label}: cannot be read ({reason}); give a file that is there and readable"
            ) from None
        return data

    def _decode_data(self, uri: str, field: str) -> bytes:
        head, comma, body = uri.partition(",")
        if not comma:
            raise SceneError(f"{field}: '{_shorten(uri)}'; give data:[type][;base64],BYTES")
        self._check_size(len(body) * 3 // 4, field)
        if not head.endswith(";base64"):
            return unquote_to_bytes(body)
        try:
            return binascii.a2b_base64(unquote(body).encode("ascii"), strict_mode=True)
        except (binascii.Error, UnicodeEncodeError) as error:
            raise SceneError(f"{field}: base64 data is broken ({error}); encode it anew") from None

    def _check_size(self, size: int, label: str) -> None:
        if size > self._limits.file_bytes:
            raise ResourceError(
                f"{label}: more than {self._limits.file_bytes} bytes; give a smaller file"
            )


def _shorten(uri: str) -> str:
    return uri if len(uri) <= 60 else uri[:59] + "…"

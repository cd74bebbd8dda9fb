"""Reading a sequence that `animate` made."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from lfd_render.engine.manifest import MANIFEST, Manifest
from lfd_render.errors import OptionError, PictureError
from lfd_render.panel.picture import Pixels, read_picture

_REMAKE = "'animate … --resume' makes it again"


@dataclass(frozen=True)
class FinishedSequence:
    """kind: eia, quilt or look. files: of its frames without a gap. hashes: theirs, SHA-256."""

    folder: Path
    kind: str
    fps: float
    files: tuple[str, ...]
    hashes: tuple[str, ...]

    @staticmethod
    def load(folder: str | Path, chosen: range | None = None) -> FinishedSequence:
        """The sequence of a folder's manifest, or the chosen frames of it. Raises PictureError for
        one with gaps, or not of PNGs, and for what is none; OptionError for frames it lacks."""
        folder = Path(folder)
        path = folder / MANIFEST
        try:
            text = path.read_bytes().decode(errors="replace")
        except OSError as error:
            raise PictureError(
                f"{path}: cannot be read: {error.strerror}; give a folder that 'animate' made"
            ) from error
        manifest = Manifest.parse(text, str(path), PictureError)
        settings = manifest.settings
        if settings.get("format") != "png":
            raise PictureError(f"{path}: frames are {settings.get('format')}; a video takes png")
        numbers = {int(m[1]): name for name in manifest.hashes if (m := _NUMBER.match(name))}
        if not numbers:
            raise PictureError(f"{path}: tells of no frame yet; --resume makes them")
        frames = chosen or range(min(numbers), max(numbers) + 1)
        missing = [frame for frame in frames if frame not in numbers]
        if missing and chosen:
            raise OptionError("frames", f"frame {missing[0]} is not in {path}; leave it out")
        if missing:
            raise PictureError(
                f"{path}: frame {missing[0]} and {len(missing) - 1} more are missing between "
                "others; 'animate … --resume' makes them, or give --frames without a gap"
            )
        files = tuple(numbers[frame] for frame in frames)
        return FinishedSequence(
            folder, str(settings.get("picture")), float(settings.get("fps", 0)), files,
            tuple(manifest.hashes[name] for name in files),
        )  # fmt: skip

    def pictures(self) -> Iterator[Pixels]:
        """Frame by frame, uint8 [y, x, 3], as stored. Raises PictureError for one that is gone or
        is not what was made."""
        for name, sha256 in zip(self.files, self.hashes, strict=True):
            path = self.folder / name
            try:
                with path.open("rb") as file:
                    found = hashlib.file_digest(file, "sha256").hexdigest()
            except OSError as error:
                raise PictureError(
                    f"{path}: cannot be read: {error.strerror}; {_REMAKE}"
                ) from error
            if found != sha256:
                raise PictureError(f"{path}: is not what its manifest tells of; {_REMAKE}")
            yield read_picture(path)


_NUMBER = re.compile(r"frame_(\d{6})[._]")

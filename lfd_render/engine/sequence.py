"""A sequence: numbered pictures of a scene before a moving window, and what they depend on."""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from lfd_render.display import Camera, DisplayProfile
from lfd_render.engine import encoding
from lfd_render.engine.choices import Choices
from lfd_render.engine.digests import environment_digest
from lfd_render.engine.jobs import Job, PanelImage, QuiltPicture, SceneFacts, SceneSource, Seen
from lfd_render.engine.motion import Motion
from lfd_render.engine.quilts import chosen_size
from lfd_render.errors import OptionError
from lfd_render.panel.quilt_names import QuiltLayout, named_path
from lfd_render.scene import Environment
from lfd_render.version import __version__

MOST_FRAMES = 1_000_000
SUFFIXES = {encoding.PNG: ".png", encoding.EXR: ".exr"}
_KINDS = {PanelImage: "eia", QuiltPicture: "quilt", Seen: "look"}


@dataclass(frozen=True)
class Sequence:
    """Frame n shows the time n / fps. media: PNG, or EXR of panel images. Raises OptionError."""

    scene: SceneSource
    display: DisplayProfile
    product: PanelImage | QuiltPicture | Seen
    motion: Motion
    fps: float
    media: str = encoding.PNG
    choices: Choices = field(default_factory=Choices)

    def __post_init__(self) -> None:
        """Check what goes with what."""
        if not 0 < self.fps <= 1000:
            raise OptionError("fps", f"{self.fps}; give a number above 0, at most 1000")
        if self.media == encoding.EXR and not isinstance(self.product, PanelImage):
            raise OptionError("format", f"exr is for panel images; a {self.kind} is written as png")
        if isinstance(self.product, QuiltPicture):
            for name in ("views", "view_size"):
                if getattr(self.choices, name) is not None:
                    raise OptionError(name, "a quilt's tiles say; give tiles and size")

    @property
    def kind(self) -> str:
        """eia, quilt or look."""
        return _KINDS[type(self.product)]

    @property
    def facts(self) -> Job:
        """What the scene holds, with its digest."""
        return Job(SceneFacts(digest=True), encoding.JSON, self.scene)

    def job(self, frame: int) -> Job:
        """What makes a frame."""
        choices = self.motion.at(self.choices, frame / self.fps)
        return Job(self.product, self.media, self.scene, self.display, choices)

    def name(self, frame: int) -> str:
        """A frame's file; a quilt's says how it is tiled."""
        stem = f"frame_{frame:06d}"
        if not isinstance(self.product, QuiltPicture):
            return stem + SUFFIXES[self.media]
        asked = self.product
        size = chosen_size(self.display, asked.device, asked.tiles, asked.size)
        aspect = self.display.size_mm[0] / self.display.size_mm[1]
        return named_path(stem, QuiltLayout(size.columns, size.rows, aspect)).name

    def settings(self) -> dict[str, Any]:
        """All that the frames depend on but the scene's content, as JSON, by dotted names."""
        camera, light = self.choices.camera, self.choices.environment
        plain = replace(self.choices, camera=None, environment="none")
        return {
            "version": __version__,
            "scene.name": self.scene.name,
            "display.name": self.display.name,
            "display.hash": self.display.hash,
            "picture": self.kind,
            **{f"picture.{k}": _plain(v) for k, v in asdict(self.product).items()},
            "format": SUFFIXES[self.media][1:],
            "fps": self.fps,
            **{f"motion.{name}": value for name, value in asdict(self.motion).items()},
            **{k: _plain(v) for k, v in asdict(plain).items()},
            "camera": camera.to_json_dict() if isinstance(camera, Camera) else camera,
            "environment": environment_digest(light) if isinstance(light, Environment) else light,
        }


def parse_frames(text: str) -> range:
    """The frames of ``0:59``, both ends included, or of a single ``7``. Raises OptionError."""
    match = re.fullmatch(r"(\d{1,9})(?::(\d{1,9}))?", text.strip())
    if not match:
        raise OptionError("frames", f"'{text}'; give FIRST:LAST, as 0:59, or one number")
    first = int(match[1])
    last = int(match[2] or first)
    if last < first:
        raise OptionError("frames", f"'{text}' runs backwards; give {last}:{first}")
    if last >= MOST_FRAMES:
        raise OptionError("frames", f"'{text}'; numbers go up to {MOST_FRAMES - 1}")
    return range(first, last + 1)


def _plain(value: object) -> object:
    """As JSON reads it back."""
    return list(value) if isinstance(value, tuple) else value

"""What is asked of a render process, and what it answers: plain data that goes through a pipe."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from lfd_render.display import DisplayProfile
from lfd_render.engine.choices import Choices
from lfd_render.engine.encoding import EXR
from lfd_render.panel.eyes import EYES_APART_MM
from lfd_render.panel.look import Optics
from lfd_render.scene import LoadLimits
from lfd_render.version import __version__


@dataclass(frozen=True)
class SceneSource:
    """Where a scene is read from. id: what processes know it by; path: a file, or builtin:NAME;
    name: what messages call it."""

    id: str
    path: str
    name: str
    limits: LoadLimits = field(default_factory=LoadLimits)


@dataclass(frozen=True)
class PanelImage:
    """The panel image (EIA)."""


@dataclass(frozen=True)
class Seen:
    """What eyes in front of the panel see of its image: one of angle, eye and sweep, as `stands`
    takes them. size: width and height of an eye's picture."""

    angle: float | None = None
    eye: str | None = None
    sweep: str | None = None
    stereo: bool = False
    eyes_apart: float = EYES_APART_MM
    crosstalk: float | None = None
    optics: Optics = "rig"
    size: tuple[int, int] | None = None


@dataclass(frozen=True)
class OneView:
    """A single upright view, by its number from the left or its angle in degrees."""

    index: int | None = None
    angle: float | None = None


@dataclass(frozen=True)
class AllViews:
    """All upright views, in an archive."""


@dataclass(frozen=True)
class QuiltPicture:
    """All upright views tiled: as a device wants them, or in tiles (columns, rows) of a size."""

    device: str | None = None
    tiles: tuple[int, int] | None = None
    size: tuple[int, int] | None = None


@dataclass(frozen=True)
class SceneFacts:
    """What a scene holds, as JSON. digest: with a hash of all of it."""

    digest: bool = False


@dataclass(frozen=True)
class ViewMap:
    """Which view each subpixel of a panel shows."""


@dataclass(frozen=True)
class Pattern:
    """A test pattern of display.patterns for a panel. view, width, colour: those of a grating.
    through: the panel before which an eye sees it, by default at its viewing distance, in a picture
    of a size; else the panel's own pixels are made."""

    kind: str
    view: int | None = None
    width: int | None = None
    colour: str | None = None
    through: DisplayProfile | None = None
    eye: tuple[float, float, float] | None = None
    size: tuple[int, int] | None = None


Product = PanelImage | Seen | OneView | AllViews | QuiltPicture | SceneFacts | ViewMap | Pattern


@dataclass(frozen=True)
class Job:
    """One thing to make. media: the media type to encode it in; scene is None for view maps
    and patterns, display for scene facts."""

    product: Product
    media: str
    scene: SceneSource | None = None
    display: DisplayProfile | None = None
    choices: Choices = field(default_factory=Choices)

    @cached_property
    def frame_key(self) -> str:
        """What the panel image depends on, and so whether a process has it already."""
        return _digest(self._scene_id, self._display, self.choices, self.media == EXR)

    @cached_property
    def stage_key(self) -> str:
        """What decides whether a process can go on with what it has on the device."""
        still = replace(
            self.choices, camera=None, focus_distance=None, yaw=0.0, pitch=0.0, depth_scale=1.0,
            dolly=0.0, exposure=None,
        )  # fmt: skip
        return _digest(self._scene_id, self._display, still)

    @cached_property
    def key(self) -> str:
        """What the answer's bytes depend on, this program's version included."""
        return _digest(
            self._scene_id, self._display, self.choices, self.product, self.media, __version__
        )

    @property
    def _scene_id(self) -> str | None:
        return self.scene.id if self.scene else None

    @property
    def _display(self) -> str | None:
        return self.display.to_json() if self.display else None


def _digest(*parts: object) -> str:
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:32]


@dataclass(frozen=True)
class Result:
    """The encoded picture; report: what `--json` of the command line prints."""

    body: bytes | memoryview
    media: str
    report: dict[str, Any] = field(default_factory=dict)
    timings_ms: dict[str, float] = field(default_factory=dict)


# Messages to a process: Work, Cancel and Forget; from it: the rest.
@dataclass(frozen=True)
class Work:
    """A job under the number by which its answer is known."""

    number: int
    job: Job


@dataclass(frozen=True)
class Cancel:
    """The answer to this number is no longer wanted."""

    number: int


@dataclass(frozen=True)
class Forget:
    """Keep nothing of this scene."""

    scene: str


@dataclass(frozen=True)
class Ready:
    """A process has its context."""

    renderer: str
    software: bool


@dataclass(frozen=True)
class NotReady:
    """A process could not open its device, and ends."""

    message: str


@dataclass(frozen=True)
class Progress:
    """The part of a job that is done, 0 to 1."""

    number: int
    part: float


@dataclass(frozen=True)
class Failed:
    """A job ended in an error: its class in lfd_render.errors and what it was made with, or the
    trace of one that nobody expected."""

    number: int
    kind: str
    arguments: tuple[Any, ...]
    trace: str | None = None
    holds: Holds | None = None


@dataclass(frozen=True)
class Done:
    """A job's answer, without the body, whose so many bytes follow it."""

    number: int
    result: Result
    holds: Holds
    body_bytes: int


@dataclass(frozen=True)
class Holds:
    """What a process has at hand: parsed scenes, finished panel images by their frame keys, and
    the stage key of what is on its device."""

    scenes: frozenset[str]
    frames: frozenset[str]
    stage: str | None

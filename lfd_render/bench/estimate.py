"""How long a run will take: a rough rule before it starts, put right by what has been done."""

from __future__ import annotations

from collections.abc import Sequence

from lfd_render.bench.contenders import BEST_COUNT, BEST_MVR, Contender
from lfd_render.bench.measure import Effort
from lfd_render.bench.suites import Group
from lfd_render.gpu.device import Device
from lfd_render.scene.builtin import PREFIX, parse_builtin

# Seconds of a frame of 48 views of 480 × 360 on two cores of a software device, and of each million
# triangles more: between what the four bench scenes took, within a factor of 2.6 of each.
_FRAME_S = {
    "lfdpr": (0.7, 0.6),
    "lfdpr:paper": (3.5, 4.0),
    "mvr": (3.0, 15.0),
    "deferred": (1.2, 6.0),
}
_APPLICATIONS_S = {"ids": (0.3, 4.0), "g-buffers": (2.0, 5.0), "shadow maps": (0.3, 3.0)}
_ROW_S = 2.0  # to upload, compile and judge
_STANDARD_S = 4.0  # of a view
_GOLD_S = 12.0  # of 96 views of 960 × 540
_FILE_MTRIS = 0.5  # of a scene whose file has not been looked at
_HARDWARE = 0.01  # of the same frames


def seconds(group: Group, effort: Effort, device: Device, *, cores: int) -> float:
    """Of one group."""
    speed = max(1, cores) / 2 if device.info.software else 1 / _HARDWARE
    spent = (
        0.0
        if group.application
        else _STANDARD_S * effort.compared * (effort.samples / 8) ** 2 / speed
    )
    if effort.gold_size and group.suites & {"aa", "ideas"}:
        spent += _GOLD_S * effort.gold_size[0] * effort.gold_size[1] / (960 * 540) / speed
    for contender in group.contenders:
        if contender.technique != BEST_MVR and contender.problem(device, group.eyes):
            continue
        ms = 1000 * _frame_s(group, contender) / speed
        hopeless = group.ranks and not contender.technique.endswith("-deferred")
        frames = 1 if hopeless else 1 + effort.frames(ms, group.ranks)
        many = BEST_COUNT if contender.technique == BEST_MVR else 1
        spent += many * (_ROW_S + 0.001 * ms * frames)
    return spent


def _frame_s(group: Group, contender: Contender) -> float:
    millions = _FILE_MTRIS
    if group.scene.startswith(PREFIX):
        millions = parse_builtin(group.scene)[1]["triangles"] / 1e6
    deferred = contender.technique.endswith("-deferred") or contender.technique == BEST_MVR
    kind = "deferred" if deferred else "mvr" if contender.rasterises else contender.technique
    pixels, triangles = _FRAME_S.get(kind, _FRAME_S["deferred"])
    if contender.application and contender.rasterises:
        pixels, triangles = _APPLICATIONS_S[contender.application]
    width, height = group.view_size or (480, 360)
    share = width * height * group.supersample[0] ** 2 / (480 * 360)
    return (pixels * share + triangles * millions) * group.eyes / 48


class Progress:
    """Time left, from the rule and how wrong it was so far."""

    def __init__(self, guesses: Sequence[float]) -> None:
        """guesses: of all groups, in order."""
        self.guesses = guesses
        self._done = self._spent = 0.0

    def add(self, guess: float, spent: float) -> None:
        """One group is done."""
        self._done, self._spent = self._done + guess, self._spent + spent

    @property
    def part(self) -> float:
        """Of the whole, 0 to 1."""
        return self._done / max(sum(self.guesses), 1e-9)

    @property
    def left_s(self) -> float:
        """Until all groups are done."""
        wrong = self._spent / self._done if self._done else 1.0
        return max(0.0, sum(self.guesses) - self._done) * wrong


def span(spent: float) -> str:
    """As people say it: 40 s, 12 min, 1 h 05 min."""
    minutes = round(spent / 60)
    if spent < 90:
        return f"{spent:.0f} s"
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02} min"

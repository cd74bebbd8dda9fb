"""Who takes part in a comparison: techniques by name, and which of them a device can run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from lfd_render.errors import UsageError
from lfd_render.gpu.device import Device
from lfd_render.techniques.mvr import VARIANTS, notation, problem

ALL_MVR = "mvr:all"
# Of the catalogue what its authors recommend, and the plain one, each with both kinds of shading.
USUAL = (
    "lfdpr",
    "lfdpr:paper",
    "mvr:multipass",
    "mvr:multipass-deferred",
    "mvr:instanced-4-deferred",
    "mvr:invocations-4-deferred",
    "mvr:multiview-4-deferred",
)
_PRESETS = ("default", "paper")


@dataclass(frozen=True)
class Contender:
    """A technique, as ``lfdpr``, ``lfdpr:PRESET`` or ``mvr:VARIANT``, and a filter of the panel."""

    technique: str
    aa: str = "none"

    @property
    def name(self) -> str:
        """What tables call it."""
        return self.technique + ("" if self.aa == "none" else f", {self.aa} AA")

    @property
    def rasterises(self) -> bool:
        """Whether it is one of the rivals: multi-view rasterisation."""
        return self.technique.startswith("mvr")

    @property
    def notation(self) -> str:
        """As the catalogue of Unterguggenberger et al. writes it; empty for others."""
        return notation(self.technique.partition(":")[2]) if self.rasterises else ""

    @property
    def options(self) -> dict[str, Any]:
        """Of `RenderOptions`."""
        kind, _, detail = self.technique.partition(":")
        chosen = {"mvr": detail} if kind == "mvr" else {"preset": detail or "default"}
        return {"technique": kind, "aa": self.aa, "linear": False, **chosen}

    def problem(self, device: Device, eyes: int) -> str | None:
        """Why the device cannot run it; None if it can."""
        if not self.rasterises:
            return None  # or it says so itself, as rivals from outside do
        return problem(device, self.technique.partition(":")[2], eyes)


def techniques(names: Sequence[str]) -> tuple[str, ...]:
    """Names checked, `mvr` and `mvr:all` spelled out, none twice. Raises UsageError."""
    found: dict[str, None] = {}
    for name in names:
        kind, _, detail = name.partition(":")
        if name == ALL_MVR:
            found |= dict.fromkeys(f"mvr:{variant}" for variant in VARIANTS)
        elif kind == "mvr" and (not detail or detail in VARIANTS):
            found[f"mvr:{detail or 'multipass'}"] = None
        elif kind == "lfdpr" and (not detail or detail in _PRESETS):
            found["lfdpr" if detail in ("", "default") else name] = None
        else:
            raise UsageError(
                f"technique '{name}': unknown; use lfdpr, lfdpr:paper, {ALL_MVR} or "
                f"mvr:VARIANT of {', '.join(VARIANTS)}"
            )
    return tuple(found)

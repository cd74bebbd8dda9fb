"""Who takes part in a comparison: techniques by name, and which of them a device can run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lfd_render.errors import UsageError
from lfd_render.gpu.device import Device
from lfd_render.techniques.mvr import VARIANTS, notation, problem

ALL_MVR = "mvr:all"
BEST_MVR = "mvr:best"  # the fastest of the scene's ranking, at most BEST_COUNT of them
PLAIN_MVR = "mvr:multipass"
BEST_COUNT = 2
RANKED_CLOSE = 1.25  # how much slower than the fastest one may be in a ranking and still become it
TIMED_CLOSE = 1.05  # and once it is timed with all views
USUAL = ("lfdpr", "lfdpr:paper", PLAIN_MVR, BEST_MVR)
_PRESETS = ("default", "paper")
# Each changes one choice of the default preset (docs/lfdpr.md).
IDEAS: dict[str, dict[str, Any]] = {
    "density isotropic": {"density": "isotropic"},
    "no texture limit": {"texture_limit": False},
    "stochastic culling": {"stochastic_culling": True},
    "culling by vertices": {"culling": "vertices"},
    "shade by rays": {"shade": "ray"},
    "shade shared": {"shade": "shared"},
    "shade at points": {"shade": "point"},
    "lattice paper": {"lattice": "paper"},
    "lattice paper, isotropic": {"lattice": "paper", "density": "isotropic"},
    "lattice paper, no limit": {"lattice": "paper", "texture_limit": False},
    "lattice paper, raster": {"lattice": "paper", "point_source": "raster"},
    "splat two-pass": {"splat": "two-pass"},
    "lod none": {"lod": "none"},
    "lod area": {"lod": "area"},
    "lod long-axis": {"lod": "long-axis"},
    "lod multiview": {"lod": "multiview"},
    "weave linear": {"weave": "linear"},
    "continuous angles": {"views": "continuous"},
}


@dataclass(frozen=True)
class Contender:
    """A technique, as ``lfdpr``, ``lfdpr:PRESET``, ``exact`` or ``mvr:VARIANT``, and the panel's
    filter. application: what it makes instead of a panel image, of `applications.APPLICATIONS`;
    idea: what it does otherwise, of IDEAS."""

    technique: str
    aa: str = "none"
    application: str = ""
    idea: str = ""

    @property
    def name(self) -> str:
        """What tables call it."""
        aa = "" if self.aa == "none" else f"{self.aa} AA"
        return ", ".join(filter(None, (self.technique, aa, self.idea)))

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
        return {
            "technique": kind,
            "aa": self.aa,
            "linear": False,
            **chosen,
            **IDEAS.get(self.idea, {}),
        }

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
        if name == BEST_MVR:
            found[name] = None
        elif name == ALL_MVR:
            found |= dict.fromkeys(f"mvr:{variant}" for variant in VARIANTS)
        elif kind == "mvr" and (not detail or detail in VARIANTS):
            found[f"mvr:{detail or 'multipass'}"] = None
        elif kind == "lfdpr" and (not detail or detail in _PRESETS):
            found["lfdpr" if detail in ("", "default") else name] = None
        elif name == "exact":
            found[name] = None
        else:
            raise UsageError(
                f"technique '{name}': unknown; use lfdpr, lfdpr:paper, exact, {BEST_MVR}, "
                f"{ALL_MVR} or mvr:VARIANT of {', '.join(VARIANTS)}"
            )
    return tuple(found)


def fastest(
    device: Device, times_ms: Mapping[str, float], eyes: int, close: float = RANKED_CLOSE
) -> tuple[str, ...]:
    """Of techniques those that may be the best with so many eyes, fastest first: who is `close`
    times slower than the first cannot become it."""
    able = {
        name: ms
        for name, ms in sorted(times_ms.items(), key=lambda item: item[1])
        if Contender(name).problem(device, eyes) is None
    }
    least = min(able.values(), default=0.0)
    near = [name for name, ms in able.items() if ms <= close * least]
    return tuple(near[:BEST_COUNT]) or (f"{PLAIN_MVR}-deferred",)

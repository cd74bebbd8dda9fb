"""The calibration profile of a display: read, checked, written, and what follows from it."""

from __future__ import annotations

import difflib
import functools
import hashlib
import json
import math
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError, model_validator

from lfd_render.data import data_folder
from lfd_render.display.files import replacing
from lfd_render.display.looking_glass import is_visual_json, profile_data
from lfd_render.display.model import (
    KINDS_OF_MODE,
    MAX_VIEWS,
    SCHEMA,
    Cells,
    Lens,
    ProfileFields,
    ProfileFile,
    Spacing,
    resolve_lens,
)
from lfd_render.display.phase import PhaseTables, phase_tables
from lfd_render.display.rig import Rig
from lfd_render.display.strict import one_line, read_json_text
from lfd_render.errors import ProfileError, UsageError


class DisplayProfile(ProfileFields):
    """A tilted-lenticular display, in canonical numbers; immutable, equal by value.

    Lengths in millimetres; `lens_count` is P, the lenses across the panel as the eye sees
    them from `distance_mm`; `drift` is T, the horizontal drift of a lens over the panel's
    height in panel widths, positive when it leans left going up.
    """

    schema_: Annotated[Literal["lfd-display/1"], Field(alias="schema")] = SCHEMA
    lens: Lens

    @model_validator(mode="after")
    def _check(self) -> DisplayProfile:
        width = self.resolution_px[0]
        if self.lens_count > width:
            raise ValueError(
                f"lens.lens_count is {self.lens_count}; it should be at most "
                f"panel.resolution_px[0] ({width}), one lens a pixel"
            )
        subpixels = self.panel.subpixels
        if isinstance(subpixels, Cells):
            kinds = KINDS_OF_MODE[subpixels.pattern_mode]
            if len(subpixels.offsets_px) < kinds:
                raise ValueError(
                    f"panel.subpixels.offsets_px has {len(subpixels.offsets_px)} cells; pattern "
                    f"mode {subpixels.pattern_mode} needs {kinds}"
                )
        return self

    @staticmethod
    def load(name_or_path: str | Path) -> DisplayProfile:
        """Profile of a shipped name, a profile file or a Looking Glass `visual.json`.

        Raises ProfileError, one line naming file, field, value and remedy.
        """
        path = _find(name_or_path)
        return DisplayProfile.from_json(read_json_text(path, ProfileError), source=str(path))

    @staticmethod
    def from_json(text: str, source: str = "profile") -> DisplayProfile:
        """Profile of a JSON text; `source` names it in errors (ProfileError)."""
        try:
            data = json.loads(text)
        except (ValueError, RecursionError) as cause:
            raise ProfileError(f"{source}: is not valid JSON: {cause}; correct the file") from cause
        if is_visual_json(data):
            text = json.dumps(profile_data(text, source))
        try:
            file = ProfileFile.model_validate_json(text)
            fields = {name: getattr(file, name) for name in ProfileFields.model_fields}
            return DisplayProfile(lens=resolve_lens(file, source), **fields)
        except ValidationError as cause:
            raise ProfileError(one_line(cause, source)) from cause

    def to_json(self) -> str:
        """Profile file text, one section a line; floats read back to the same bits."""
        data = self.model_dump(mode="json", by_alias=True, exclude_none=True)
        first = ("schema", "name", "serial", "date", "panel", "lens")
        ordered = {key: data.pop(key) for key in first if key in data} | data
        lines = (f"  {json.dumps(k)}: {json.dumps(v)}" for k, v in ordered.items())
        return "{\n" + ",\n".join(lines) + "\n}\n"

    def save(self, path: str | Path) -> None:
        """Write the profile file; `load` gives back an equal profile. Raises OutputError."""
        with replacing(Path(path)) as temporary:
            temporary.write_text(self.to_json(), encoding="utf-8")

    @staticmethod
    def json_schema() -> dict[str, Any]:
        """JSON Schema (draft 2020-12) of the profile file, generated from the model."""
        schema = ProfileFile.model_json_schema(by_alias=True)
        return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}

    @property
    def resolution_px(self) -> tuple[int, int]:
        """Panel width and height in pixels."""
        return self.panel.resolution_px

    @property
    def size_mm(self) -> tuple[float, float]:
        """Panel width and height in millimetres."""
        return self.panel.size_mm

    @property
    def lens_count(self) -> float:
        """P, the lenses across the panel."""
        return self.lens.lens_count

    @property
    def drift(self) -> float:
        """T, the horizontal drift of a lens over the panel's height, in panel widths."""
        return self.lens.drift

    @property
    def center(self) -> float:
        """Phase offset, in lenses."""
        return self.lens.center

    @property
    def index(self) -> float:
        """n, the refractive index of the lens sheet."""
        return self.lens.index

    @property
    def views(self) -> int:
        """N, the number of views that the display is driven with unless asked otherwise."""
        return self.viewing.views

    @property
    def cone_rad(self) -> float:
        """Angle over which the views spread before they repeat."""
        return math.radians(self.viewing.cone_deg)

    @property
    def distance_mm(self) -> float:
        """D, the distance from the panel to the eyes."""
        return self.viewing.distance_mm

    @property
    def spacing(self) -> Spacing:
        """Rule by which the eyes are spaced: lens, angle or tangent."""
        return self.viewing.spacing

    @property
    def tilt_rad(self) -> float:
        """Tilt of the lens axis from vertical, positive when it leans left going up."""
        width, height = self.size_mm
        return math.atan(self.drift * width / height)

    @property
    def template(self) -> bool:
        """Whether these are a model's figures and not this unit's calibration."""
        return self.provenance.template

    @property
    def hash(self) -> str:
        """16 hexadecimal digits of everything that can change a picture; stable over versions."""
        parts = self.model_dump(
            mode="json", include={"panel", "lens", "viewing", "response"}, exclude_none=True
        )
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:16]

    def phase_tables(self) -> PhaseTables:
        """Column, row and cell tables whose sum is the phase of a subpixel."""
        return phase_tables(self)

    def phase_map(self) -> NDArray[np.float64]:
        """Phase φ of every subpixel in lenses, float64 [y, x, channel], top row first."""
        return self.phase_tables().phase()

    def view_index_map(self, views: int | None = None) -> NDArray[np.uint16]:
        """View of every subpixel, uint16 [y, x, channel], top row first; view 0 leftmost."""
        count = self.views if views is None else views
        if not 1 <= count <= MAX_VIEWS:
            raise UsageError(f"views is {count}; it should be from 1 to {MAX_VIEWS}")
        return self.phase_tables().view_index_map(count)

    def rig(self, views: int | None = None, spacing: Spacing | None = None) -> Rig:
        """The cameras that this display asks for; the profile's views and spacing by default."""
        return Rig.of(self, views, spacing)


@functools.cache
def shipped_profiles() -> tuple[str, ...]:
    """Names of the profiles that come with the package, sorted."""
    return tuple(sorted(path.stem for path in data_folder("display_profiles").glob("*.json")))


def _find(name_or_path: str | Path) -> Path:
    """File of a shipped name or of a path; a text without separator or suffix is a name."""
    text, path = str(name_or_path), Path(name_or_path)
    if text in shipped_profiles():
        return data_folder("display_profiles") / f"{text}.json"
    if isinstance(name_or_path, Path) or path.suffix or path.name != text or path.is_file():
        return path
    near = difflib.get_close_matches(text, shipped_profiles(), n=3, cutoff=0.4)
    hint = f"did you mean {' or '.join(near)}?" if near else f"there are {_listed()}"
    raise ProfileError(f"{text!r} is neither a shipped display profile nor a file; {hint}")


def _listed() -> str:
    return ", ".join(shipped_profiles())

"""The calibration profile of a display: read, checked, written, and what follows from it."""

from __future__ import annotations

import datetime
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
from lfd_render.display.forms import form_data, is_form
from lfd_render.display.global3d import ini_data, is_ini
from lfd_render.display.looking_glass import is_visual_json, profile_data
from lfd_render.display.migration import to_present
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
from lfd_render.display.mounted import the_mounted_calibration
from lfd_render.display.phase import PhaseTables, phase_tables
from lfd_render.display.rig import Rig
from lfd_render.display.strict import one_line, read_json_text
from lfd_render.errors import ProfileError, UsageError

AUTO = "auto"  # stands for the display whose drive is mounted
LEAST_PIXEL_MM = 0.001  # of microdisplays they are four times as wide


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
        rows = self.correction.phase_lenses if self.correction else ((),)
        for number, row in enumerate(rows):
            if len(row) != len(rows[0]):
                raise ValueError(
                    f"correction.phase_lenses.{number} has {len(row)} columns; it should have "
                    f"{len(rows[0])}, as the first row"
                )
        pixel_mm = min(mm / px for mm, px in zip(self.size_mm, self.resolution_px, strict=True))
        if pixel_mm < LEAST_PIXEL_MM:
            raise ValueError(
                f"panel.size_mm is {list(self.size_mm)}, which makes pixels of {pixel_mm:.3g} mm; "
                "it should be in millimetres"
                + (", and looks like metres" if 0.02 < 1000 * pixel_mm < 20 else "")
            )
        if self.date is not None:
            _check_date(self.date)
        return self

    @staticmethod
    def load(name_or_path: str | Path) -> DisplayProfile:
        """Profile of a shipped name, a profile file, a file that `display convert` writes, or
        "auto", the one display whose calibration drive is mounted.

        Raises ProfileError, one line naming file, field, value and remedy.
        """
        path = _find(name_or_path)
        return DisplayProfile.from_json(read_json_text(path, ProfileError), source=str(path))

    @staticmethod
    def from_json(text: str, source: str = "profile") -> DisplayProfile:
        """Profile of a profile file's text, or another system's; `source` names it in errors.

        Raises ProfileError.
        """
        if is_ini(text):
            text = json.dumps(ini_data(text, source))
        try:
            data = json.loads(text)
        except (ValueError, RecursionError) as cause:
            raise ProfileError(f"{source}: is not valid JSON: {cause}; correct the file") from cause
        if is_visual_json(data):
            text = json.dumps(profile_data(text, source))
        elif is_form(data):
            text = json.dumps(form_data(text, source))
        elif isinstance(data, dict) and data.get("schema", SCHEMA) != SCHEMA:
            text = json.dumps(to_present(data, source))
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
            mode="json",
            include={"panel", "lens", "viewing", "response", "correction"},
            exclude_none=True,
        )
        # What was added to the format since counts only where it says something.
        for section, field, plain in _HASHED_IF_OTHER:
            part = parts[section]["subpixels"] if field == "axis" else parts[section]
            if part.get(field) == plain:
                del part[field]
        text = json.dumps(_without_signs(parts), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    @property
    def physical_lens_count(self) -> float | None:
        """Lenses of the sheet itself across the panel, P·(1 + t/(n·D)); None without a gap."""
        gap = self.lens.gap_mm
        return (
            None if gap is None else self.lens_count * (1 + gap / (self.index * self.distance_mm))
        )

    @property
    def pitch_mm(self) -> float | None:
        """p⊥, the sheet's lens pitch across the lens axis; None without a gap."""
        count = self.physical_lens_count
        return None if count is None else self.size_mm[0] / count * math.cos(self.tilt_rad)

    def at_distance(self, distance_mm: float) -> DisplayProfile:
        """The same panel for eyes at another distance, by P_eff = P/(1 + t/(n·D)).

        The lattice that the eye sees grows about the panel's middle, whose phase stays. Raises
        ProfileError without `lens.gap_mm`, UsageError for a distance that is none.
        """
        if self.lens.gap_mm is None:
            raise ProfileError(
                f"display '{self.name}': lens.gap_mm is missing; the count of another distance "
                "needs it"
            )
        if not 0 < distance_mm < math.inf:
            raise UsageError(f"distance is {distance_mm} mm; it should be above 0")
        sheet = self.physical_lens_count
        assert sheet is not None
        count = sheet / (1 + self.lens.gap_mm / (self.index * distance_mm))
        grown = (count - self.lens_count) * (0.5 + 0.5 * self.drift)
        lens = self.lens.model_copy(update={"lens_count": count, "center": self.center + grown})
        viewing = self.viewing.model_copy(update={"distance_mm": float(distance_mm)})
        return self.model_copy(update={"lens": lens, "viewing": viewing})

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


# Section, field and the value that says nothing.
_HASHED_IF_OTHER = (("panel", "axis", "right"), ("viewing", "inverted", False))


def _without_signs(value: Any) -> Any:
    """The same with 0.0 for −0.0, which equals it."""
    if isinstance(value, dict):
        return {key: _without_signs(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_without_signs(part) for part in value]
    return 0.0 if isinstance(value, float) and value == 0 else value


def _check_date(text: str) -> None:
    try:
        datetime.date.fromisoformat(text)
    except ValueError as cause:
        raise ValueError(f"date is {text!r}; it should be a day that was, as 2024-02-29") from cause


@functools.cache
def shipped_profiles() -> tuple[str, ...]:
    """Names of the profiles that come with the package, sorted."""
    return tuple(sorted(path.stem for path in data_folder("display_profiles").glob("*.json")))


def _find(name_or_path: str | Path) -> Path:
    """File of a shipped name or of a path; a text without separator or suffix is a name."""
    text, path = str(name_or_path), Path(name_or_path)
    if text == AUTO:
        return the_mounted_calibration()
    if text in shipped_profiles():
        return data_folder("display_profiles") / f"{text}.json"
    if isinstance(name_or_path, Path) or path.suffix or path.name != text or path.is_file():
        return path
    near = difflib.get_close_matches(text, shipped_profiles(), n=3, cutoff=0.4)
    hint = f"did you mean {' or '.join(near)}?" if near else f"there are {_listed()}"
    raise ProfileError(f"{text!r} is neither a shipped display profile nor a file; {hint}")


def _listed() -> str:
    return ", ".join(shipped_profiles())

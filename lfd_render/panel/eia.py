"""The elemental image array: the panel image with all views woven in."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfd_render.errors import OutputError
from lfd_render.panel.picture import write_png


@dataclass(frozen=True, eq=False)
class Eia:
    """A panel image. pixels: uint8 [y, x, 3], sRGB; linear: float16 [y, x, 3], scene-linear light
    before exposure and tone curve, None where it was not asked for; report: what was rendered, how,
    and how long it took."""

    pixels: NDArray[np.uint8]
    linear: NDArray[np.float16] | None
    report: dict[str, Any] = field(default_factory=dict)
    metadata: dict[str, str] = field(default_factory=dict)

    def save(self, path: str | Path) -> None:
        """Write `pixels` as a PNG that carries profile hash, views, technique and seed.

        Raises OutputError when it cannot be written; no partial file is left.
        """
        if Path(path).suffix.lower() != ".png":
            raise OutputError(f"{path}: an EIA is written as .png; give a name that ends so")
        write_png(path, self.pixels, self.metadata)

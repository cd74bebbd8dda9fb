"""The files a panel image can become: PNG, EXR, raw pixels, with the same metadata in each."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lfd_render.display.files import replacing
from lfd_render.errors import OutputError
from lfd_render.panel.picture import check_pixels

FORMATS = ("png", "exr", "raw")
RAW_SCHEMA = "lfd-raw/1"
_EXR_COMPRESSION = "piz"  # lossless; of a panel image 18 MB, half of what zip leaves


def format_of(path: str | Path) -> str:
    """The format that a file's name ends in. Raises OutputError for a name that ends otherwise."""
    suffix = Path(path).suffix
    if suffix.lower() not in {f".{name}" for name in FORMATS}:
        lossy = " (JPEG would mix the views of neighbouring pixels)"
        raise OutputError(
            f"{path}: suffix '{suffix}' names no format of a panel image"
            f"{lossy if suffix.lower() in ('.jpg', '.jpeg') else ''}; "
            "give a name that ends in .png, .exr or .raw"
        )
    return suffix.lower()[1:]


def write_exr(path: str | Path, linear: NDArray[np.float16], text: Mapping[str, str]) -> None:
    """Write scene-linear half floats [y, x, 3] as OpenEXR, R, G, B with Rec. 709 primaries.

    Raises OutputError when it cannot be written; no partial file is left.
    """
    import OpenImageIO as oiio  # noqa: N813, PLC0415 (slow to import; its documentation's name)

    assert linear.dtype == np.float16
    height, width, channels = linear.shape
    spec = oiio.ImageSpec(width, height, channels, "half")
    spec.attribute("compression", _EXR_COMPRESSION)
    for key, value in text.items():
        spec.attribute(key, value)
    with replacing(Path(path)) as temporary:
        output = oiio.ImageOutput.create("picture.exr")  # names the format alone
        assert output is not None
        try:
            done = output.open(str(temporary), spec) and output.write_image(
                np.ascontiguousarray(linear)
            )
        finally:
            done = output.close() and done
        if not done:
            raise OSError(0, output.geterror() or "no room?")


def write_raw(path: str | Path, pixels: NDArray[np.uint8], text: Mapping[str, str]) -> None:
    """Write uint8 [y, x, 3] as bare bytes, and what they are into ``<path>.json``.

    Raises OutputError when either cannot be written.
    """
    check_pixels(path, pixels)
    with replacing(Path(f"{path}.json")) as temporary:
        temporary.write_text(json.dumps(raw_sidecar(pixels, text), indent=1) + "\n", "utf-8")
    with replacing(Path(path)) as temporary, temporary.open("wb") as file:
        file.write(np.ascontiguousarray(pixels).data)


def raw_sidecar(pixels: NDArray[np.uint8], text: Mapping[str, str]) -> dict[str, Any]:
    """What a raw file holds, as its JSON says it."""
    height, width, _ = pixels.shape
    return {
        "schema": RAW_SCHEMA,
        "width": width,
        "height": height,
        "channels": "rgb",
        "type": "uint8",
        "rows": "top first",
        "metadata": dict(text),
    }

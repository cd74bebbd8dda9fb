"""An encoded picture as the server keeps it."""

from __future__ import annotations

from dataclasses import dataclass

from lfd_render.engine import encoding
from lfd_render.engine.jobs import (
    AllViews,
    Job,
    OneView,
    PanelImage,
    Pattern,
    Product,
    QuiltPicture,
    Result,
    SceneFacts,
    Seen,
    ViewMap,
)

_SUFFIXES = {
    encoding.PNG: "png", encoding.WEBP: "webp", encoding.JPEG: "jpg", encoding.EXR: "exr",
    encoding.RAW: "raw", encoding.ZIP: "zip", encoding.NPY: "npy",
}  # fmt: skip
_NAMES: dict[type[Product], str] = {
    PanelImage: "eia", Seen: "look", OneView: "view", AllViews: "views", QuiltPicture: "quilt",
    SceneFacts: "scene", ViewMap: "map", Pattern: "pattern",
}  # fmt: skip


@dataclass(frozen=True)
class Picture:
    """An encoded picture with what its answer's header says."""

    body: memoryview
    headers: dict[str, str]

    @staticmethod
    def of(job: Job, result: Result) -> Picture:
        """The picture of a job with its size, its name, and what a person should know."""
        report = result.report
        headers = {"LFD-Size": "x".join(map(str, report["size"]))}
        if warnings := report.get("warnings"):
            headers["LFD-Warnings"] = _header_text("; ".join(warnings))
        name = _NAMES[type(job.product)]
        headers["Content-Disposition"] = f'inline; filename="{name}.{_SUFFIXES[job.media]}"'
        return Picture(memoryview(result.body), headers)


def _header_text(text: str) -> str:
    """A text that a header can carry."""
    plain = text.encode("ascii", "replace").decode()
    return "".join(c if c.isprintable() else " " for c in plain)[:1000]

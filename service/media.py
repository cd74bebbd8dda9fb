"""Choosing a media type by ``Accept`` (RFC 9110, section 12.5.1)."""

from __future__ import annotations

from collections.abc import Sequence

from .problems import ProblemError


def choose(accept: str | None, offered: Sequence[str]) -> str:
    """The offered type that a request likes best, the earlier of equals.

    Raises ProblemError 406 when it likes none.
    """
    if not accept or not accept.strip():
        return offered[0]
    wanted = [_parsed(part) for part in accept.split(",") if part.strip()]
    best = max(offered, key=lambda media: _quality(media, wanted))
    if _quality(best, wanted) <= 0:
        raise ProblemError(
            406, f"Accept: {accept[:100]}; this is to be had as {', '.join(offered)}", "Accept"
        )
    return best


def _parsed(part: str) -> tuple[str, float]:
    media, *parameters = (piece.strip().lower() for piece in part.split(";"))
    quality = next((p[2:] for p in parameters if p.startswith("q=")), "1")
    try:
        return media, min(max(float(quality), 0.0), 1.0)
    except ValueError:
        return media, 0.0


def _quality(media: str, wanted: list[tuple[str, float]]) -> float:
    """What the most specific range that matches says."""
    kind = media.split("/", maxsplit=1)[0]
    for pattern in (media, f"{kind}/*", "*/*"):
        for name, quality in wanted:
            if name == pattern:
                return quality
    return 0.0

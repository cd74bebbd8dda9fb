"""The page: what stands in ``web/``, as it is, and nothing from elsewhere."""

from __future__ import annotations

import hashlib
from pathlib import Path

from fastapi import APIRouter, Request, Response

from .problems import ProblemError
from .responses import matches

router = APIRouter(include_in_schema=False)

PAGES = {"/": "index.html", "/calibrate": "calibrate.html", "/panel": "panel.html"}
FOLDER = "/page/"
_MEDIA = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}
_WEB = Path(__file__).parent / "web"
_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self' blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-cache",
}
_FILES = {file.name: file.read_bytes() for file in _WEB.iterdir() if file.suffix in _MEDIA}


def is_page(path: str) -> bool:
    """Whether a path leads to the page, which holds nothing to keep from anyone."""
    return path in PAGES or path.startswith(FOLDER)


def _file(request: Request, name: str) -> Response:
    body = _FILES.get(name)
    if body is None:
        raise ProblemError(404, f"{FOLDER}{name[:100]}: is no part of the page")
    tag = f'"{hashlib.sha256(body).hexdigest()[:32]}"'
    headers = _HEADERS | {"ETag": tag}
    if matches(request.headers.get("if-none-match"), tag):
        return Response(status_code=304, headers=headers)
    return Response(body, headers=headers, media_type=_MEDIA[Path(name).suffix])


@router.api_route("/", methods=["GET", "HEAD"])
@router.api_route("/calibrate", methods=["GET", "HEAD"])
@router.api_route("/panel", methods=["GET", "HEAD"])
async def page(request: Request) -> Response:
    """The page, its calibration, or the window that shows a panel's pixels."""
    return _file(request, PAGES[request.scope["route"].path])


@router.api_route("/page/{name}", methods=["GET", "HEAD"])
async def part(request: Request, name: str) -> Response:
    """A style, a script, a picture of the page."""
    return _file(request, name)

"""What answers have in common, and those that are sent piece by piece."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Mapping

from fastapi import Response
from starlette.types import Receive, Scope, Send

from .clients import unless_gone

PIECE_BYTES = 1 << 18
ALWAYS = {
    "Vary": "Accept, Origin",
    "Cache-Control": "private, no-cache",
    "X-Content-Type-Options": "nosniff",
}  # what the header of every picture says


def matches(header: str | None, tag: str) -> bool:
    """Whether If-None-Match names a tag (RFC 9110, section 13.1.2)."""
    if header is None:
        return False
    tags = [part.strip().removeprefix("W/") for part in header.split(",")]
    return "*" in tags or tag in tags


class PiecesResponse(Response):
    """A body sent in pieces, so that one who does not read it is noticed and others get their turn
    between them."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """As ASGI has it."""
        await send(
            {
                "type": "http.response.start",
                "status": self.status_code,
                "headers": self.raw_headers,
            }
        )
        body = memoryview(self.body)
        for start in range(0, max(len(body), 1), PIECE_BYTES):
            end = start + PIECE_BYTES
            piece = body[start:end]
            await send({"type": "http.response.body", "body": piece, "more_body": end < len(body)})


class LiveResponse(Response):
    """A body that is made while it is sent: the next piece when the client has taken the last one.
    Its generator is closed when the client goes."""

    def __init__(
        self, pieces: AsyncGenerator[bytes], media_type: str, headers: Mapping[str, str]
    ) -> None:
        super().__init__(headers=headers, media_type=media_type)
        self._pieces = pieces
        if "content-length" not in headers:
            del self.headers["content-length"]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """As ASGI has it."""
        await unless_gone(receive, self._send(send))

    async def _send(self, send: Send) -> None:
        start = {"type": "http.response.start", "status": 200, "headers": self.raw_headers}
        try:
            await send(start)
            async for piece in self._pieces:
                await send({"type": "http.response.body", "body": piece, "more_body": True})
            await send({"type": "http.response.body", "body": b""})
        finally:
            await self._pieces.aclose()

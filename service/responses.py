"""What answers have in common, and those that are sent piece by piece."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Mapping
from contextlib import aclosing

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
            piece = bytes(body[start:end])  # as ASGI has it, and Ray needs it
            await send({"type": "http.response.body", "body": piece, "more_body": end < len(body)})


class LiveResponse(Response):
    """A body that is made while it is sent: the next piece when the client has taken the last one.
    Its generator is closed when the client goes; `until` ends it before."""

    def __init__(
        self,
        pieces: AsyncGenerator[bytes],
        media_type: str,
        headers: Mapping[str, str],
        until: asyncio.Event | None = None,
    ) -> None:
        super().__init__(headers=headers, media_type=media_type)
        self._pieces, self._until = pieces, until or asyncio.Event()
        if "content-length" not in headers:
            del self.headers["content-length"]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """As ASGI has it."""
        async with aclosing(self._pieces):
            await unless_gone(receive, self._send(send))

    async def _send(self, send: Send) -> None:
        # The first piece before all else: what hinders it still becomes a problem's answer.
        piece = await anext(self._pieces, None)
        await send({"type": "http.response.start", "status": 200, "headers": self.raw_headers})
        ending = asyncio.create_task(self._until.wait())
        try:
            while piece is not None:
                await send({"type": "http.response.body", "body": piece, "more_body": True})
                making = asyncio.create_task(self._next())
                try:
                    await asyncio.wait((making, ending), return_when=asyncio.FIRST_COMPLETED)
                    piece = making.result() if making.done() else None
                finally:
                    making.cancel()
                    await asyncio.wait((making,))
        finally:
            ending.cancel()
        await send({"type": "http.response.body", "body": b""})

    async def _next(self) -> bytes | None:
        return await anext(self._pieces, None)

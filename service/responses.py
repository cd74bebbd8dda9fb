"""Large answers, in pieces."""

from __future__ import annotations

from fastapi import Response
from starlette.types import Receive, Scope, Send

_PIECE_BYTES = 1 << 18


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
        for start in range(0, max(len(body), 1), _PIECE_BYTES):
            end = start + _PIECE_BYTES
            piece = body[start:end]
            await send({"type": "http.response.body", "body": piece, "more_body": end < len(body)})

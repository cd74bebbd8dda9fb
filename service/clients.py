"""Working for a client only as long as it is there."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from starlette.types import Receive

from .problems import ProblemError

T = TypeVar("T")


class Slots:
    """Places for clients that stay."""

    def __init__(self, most: int) -> None:
        self._most = most
        self.taken = 0

    @contextmanager
    def slot(self) -> Iterator[None]:
        """A place. Raises ProblemError 429 when none is free."""
        if self.taken >= self._most:
            raise ProblemError(
                429, f"{self.taken} streams are being sent; ask again in 10 s", None,
                {"Retry-After": "10"},
            )  # fmt: skip
        self.taken += 1
        try:
            yield
        finally:
            self.taken -= 1


class ClientGoneError(Exception):
    """Nobody waits for the answer, or reads it."""


async def unless_gone(receive: Receive, work: Coroutine[Any, Any, T]) -> T:
    """What comes of the work, which is called off with ClientGoneError as soon as the client goes.

    The request's body has been read.
    """
    working = asyncio.create_task(work)
    gone = asyncio.create_task(_disconnected(receive))
    try:
        await asyncio.wait((working, gone), return_when=asyncio.FIRST_COMPLETED)
        if not working.done():
            raise ClientGoneError
        return working.result()
    finally:
        gone.cancel()
        working.cancel()
        await asyncio.wait((working, gone))  # what the work holds is free again


async def _disconnected(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass

"""Knowing that the server is about to end before what it serves has ended."""

from __future__ import annotations

import asyncio
import signal
import threading
from types import FrameType


def tell_of_signals(ending: asyncio.Event) -> None:
    """Set the event at SIGTERM and SIGINT, besides what they did before.

    The server tells the application only when all answers are sent, which streams' never would be.
    """
    if threading.current_thread() is not threading.main_thread():
        return  # where another program owns the signals
    loop = asyncio.get_running_loop()
    for number in (signal.SIGTERM, signal.SIGINT):
        before = signal.getsignal(number)

        def tell(number: int, frame: FrameType | None, before: object = before) -> None:
            loop.call_soon_threadsafe(ending.set)
            if callable(before):
                before(number, frame)

        if callable(before):
            signal.signal(number, tell)

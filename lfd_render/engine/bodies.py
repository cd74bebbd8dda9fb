"""Handing large answers from one process to another in memory that both see.

A pipe would copy a panel image twice more and take more than twice as long.
"""

from __future__ import annotations

import mmap
import os
import socket
from multiprocessing.connection import Connection

from lfd_render.errors import ResourceError

LARGE = 1 << 20  # bytes of what stays where it came; each keeps a file descriptor


def send_body(pipe: Connection, body: bytes | memoryview) -> None:
    """Send bytes after a message that says how many; nothing for none."""
    if not body:
        return
    memory = os.memfd_create("picture")
    try:
        _write(memory, memoryview(body))
        with socket.fromfd(pipe.fileno(), socket.AF_UNIX, socket.SOCK_STREAM) as channel:
            socket.send_fds(channel, [b"m"], [memory])
    finally:
        os.close(memory)


def receive_body(pipe: Connection, size: int) -> memoryview:
    """The bytes that follow a message; the memory goes when nobody looks at them. Raises EOFError
    when the other end has gone, ResourceError without a file descriptor to spare."""
    if not size:
        return memoryview(b"")
    with socket.fromfd(pipe.fileno(), socket.AF_UNIX, socket.SOCK_STREAM) as channel:
        token, descriptors, _, _ = socket.recv_fds(channel, 1, 1)
    if not token:
        raise EOFError
    if not descriptors:
        raise ResourceError("too many open files; raise the limit or ask again later")
    with os.fdopen(descriptors[0], "rb") as memory:
        if size < LARGE:  # many of these are kept
            memory.seek(0)
            return memoryview(memory.read(size))
        return memoryview(mmap.mmap(memory.fileno(), size, prot=mmap.PROT_READ))


def _write(descriptor: int, view: memoryview) -> None:
    while view:
        view = view[os.write(descriptor, view) :]

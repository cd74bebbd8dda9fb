"""PNG encoding: lossless, in strips that the processor's cores filter and deflate side by side.

PNG (ISO/IEC 15948) filters each row and deflates the rows as one zlib stream (RFC 1950). Here every
row takes filter Up: in a panel image the pixel above shows the next view, the pixel beside it one
several views away. Each strip is deflated by ISA-L and ends on a byte (RFC 1951's empty stored
block), so strips join to one stream. How rows are cut depends on the picture's size alone.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

SIGNATURE = b"\x89PNG\r\n\x1a\n"
_STRIP_BYTES = 3 << 20  # a 4K panel makes eight strips
_LEVEL = 1  # of ISA-L's four; the others save up to 1 % and take a quarter longer
_UP = 2
_ZLIB_HEADER = b"\x78\x01"  # deflate, 32 KiB window, fastest
_ADLER_BASE = 65521


def png_chunks(
    pixels: NDArray[np.uint8], text: Mapping[str, str] | None = None, exif: bytes | None = None
) -> list[bytes]:
    """The parts of a PNG file, in order, of uint8 [y, x, 3].

    text: entries by keyword, of Latin-1 (1 to 79 characters). exif: a TIFF structure, as in an
    eXIf chunk.
    """
    height, width, channels = pixels.shape
    assert pixels.dtype == np.uint8
    assert channels == 3
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = [SIGNATURE, *_chunk(b"IHDR", header)]
    for keyword, value in (text or {}).items():
        chunks += _text_chunk(keyword, value)
    if exif:
        chunks += _chunk(b"eXIf", exif)
    for part in _deflated(np.ascontiguousarray(pixels).reshape(height, 3 * width)):
        chunks += _chunk(b"IDAT", part)
    return chunks + _chunk(b"IEND", b"")


def _deflated(rows: NDArray[np.uint8]) -> list[bytes]:
    """The filtered rows [y, byte] as one zlib stream, cut between strips."""
    height, row_bytes = rows.shape
    strips = max(1, min(height, round(rows.size / _STRIP_BYTES)))
    edges = [height * strip // strips for strip in range(strips + 1)]

    def strip(index: int) -> tuple[bytes, int]:
        """Deflated bytes and Adler-32 of one strip."""
        filtered = _filtered_up(rows, edges[index], edges[index + 1])
        stream = isal_zlib.compressobj(_LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS)
        last = index == strips - 1
        # ISA-L gives the interpreter free meanwhile, so threads are enough.
        body = stream.compress(filtered.data)
        return body + stream.flush(zlib.Z_FINISH if last else zlib.Z_SYNC_FLUSH), isal_zlib.adler32(
            filtered.data
        )

    threads = min(strips, len(os.sched_getaffinity(0)))
    if threads == 1:
        found = [strip(index) for index in range(strips)]
    else:
        with ThreadPoolExecutor(threads) as pool:
            found = list(pool.map(strip, range(strips)))
    total = 1
    for index, (_, adler) in enumerate(found):
        total = _joined_adler(total, adler, (edges[index + 1] - edges[index]) * (1 + row_bytes))
    return [_ZLIB_HEADER, *(body for body, _ in found), struct.pack(">I", total)]


def _filtered_up(rows: NDArray[np.uint8], first: int, end: int) -> NDArray[np.uint8]:
    """Rows [first, end) as PNG's filter Up has them, [y, 1 + byte]: the filter's number, then each
    byte less the one above it, modulo 256."""
    filtered = np.empty((end - first, 1 + rows.shape[1]), np.uint8)
    filtered[:, 0] = _UP
    start = max(first, 1)
    np.subtract(rows[start:end], rows[start - 1 : end - 1], out=filtered[start - first :, 1:])
    if first == 0:
        filtered[0, 1:] = rows[0]
    return filtered


def _joined_adler(first: int, second: int, second_bytes: int) -> int:
    """Adler-32 of two byte strings joined: A = A₁ + A₂ − 1, B = B₁ + B₂ + n₂·(A₁ − 1)."""
    a = (first & 0xFFFF) + (second & 0xFFFF) - 1
    b = (first >> 16) + (second >> 16) + second_bytes * ((first & 0xFFFF) - 1)
    return (b % _ADLER_BASE) << 16 | a % _ADLER_BASE


def _text_chunk(keyword: str, value: str) -> list[bytes]:
    """A text entry: tEXt where Latin-1 has all its characters, else iTXt."""
    name = keyword.encode("latin-1")
    assert 1 <= len(name) <= 79, keyword
    try:
        return _chunk(b"tEXt", name + b"\0" + value.encode("latin-1"))
    except UnicodeEncodeError:
        return _chunk(b"iTXt", name + b"\0\0\0\0\0" + value.encode())


def _chunk(kind: bytes, data: bytes) -> list[bytes]:
    checksum = isal_zlib.crc32(data, isal_zlib.crc32(kind))
    return [struct.pack(">I", len(data)) + kind, data, struct.pack(">I", checksum)]

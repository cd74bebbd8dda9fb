"""A memory of what was used last, bounded in bytes."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator
from typing import Generic, TypeVar

T = TypeVar("T")


class ByteLru(Generic[T]):
    """Values by key; the least recently used go when all together weigh more than `limit` bytes.

    What alone weighs more is not kept.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._items: OrderedDict[str, tuple[T, int]] = OrderedDict()
        self.bytes = 0

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def get(self, key: str) -> T | None:
        """The value, now the most recently used, or None."""
        if key not in self._items:
            return None
        self._items.move_to_end(key)
        return self._items[key][0]

    def put(self, key: str, value: T, weight: int) -> None:
        """Keep a value of so many bytes, if it fits."""
        self.drop(key)
        if weight > self._limit:
            return
        self._items[key] = (value, weight)
        self.bytes += weight
        while self.bytes > self._limit:
            self.drop(next(iter(self._items)))

    def clear(self) -> None:
        """Forget everything."""
        self._items.clear()
        self.bytes = 0

    def drop(self, key: str) -> None:
        """Forget a key, which need not be there."""
        _, weight = self._items.pop(key, (None, 0))
        self.bytes -= weight

"""Typed reading of JSON objects: each error names the path of the field, its value, the remedy."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any, Literal, NoReturn, TypeVar

from lfd_render.errors import SceneError

_Choice = TypeVar("_Choice", bound=str)
_SHOWN = 60  # characters of a wrong value that a message repeats


def parse_json(data: bytes) -> Fields:
    """The JSON object in UTF-8 bytes; NaN, Infinity and anything else than an object is refused."""
    try:
        value = json.loads(data.decode("utf-8-sig"), parse_constant=_refuse_constant)
        if b"\\u" in data:  # half of a character, which no file or answer can hold
            json.dumps(value, ensure_ascii=False).encode()
        return Fields(value, "")
    except UnicodeEncodeError as error:
        raise SceneError(
            f"JSON: a text holds half a character ({error.object[error.start]!a}); give whole ones"
        ) from None
    except UnicodeDecodeError as error:
        raise SceneError(
            f"JSON: byte {data[error.start]:#04x} at {error.start} is not UTF-8; "
            "save the JSON as UTF-8"
        ) from None
    except RecursionError:
        raise SceneError("JSON: nested too deeply; give plain glTF JSON") from None
    except ValueError as error:
        raise SceneError(f"JSON: cannot be parsed ({error}); give a valid glTF file") from None


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is no JSON number")


class Fields:
    """One JSON object and its path in the file, as in `meshes[3].primitives[0]`."""

    def __init__(self, value: Any, path: str) -> None:
        self.path = path
        if not isinstance(value, dict):
            raise SceneError(f"{path or 'JSON'}: {_show(value)}; give a JSON object")
        self._values: dict[str, Any] = value

    def __contains__(self, key: str) -> bool:
        return key in self._values

    def keys(self) -> list[str]:
        """The names of the fields that stand in the object."""
        return list(self._values)

    def place(self, key: str) -> str:
        """The path of one field."""
        return f"{self.path}.{key}" if self.path else key

    def fail(self, key: str, remedy: str) -> NoReturn:
        """Raise SceneError for a field with its value and a remedy."""
        value = _show(self._values[key]) if key in self._values else "missing"
        raise SceneError(f"{self.place(key)}: {value}; {remedy}")

    def integer(
        self, key: str, default: int | None = None, *, low: int = 0, high: int = 1 << 53
    ) -> int:
        """A whole number from low to high; required when there is no default."""
        if key not in self._values and default is not None:
            return default
        value = _whole(self._values.get(key))
        if value is None or not low <= value <= high:
            self.fail(key, f"give a whole number from {low} to {high}")
        return value

    def index(self, key: str, count: int) -> int | None:
        """An index into a list of `count` things, or None where the field is absent."""
        if key not in self._values:
            return None
        value = _whole(self._values[key])
        if value is None or not 0 <= value < count:
            self.fail(key, _index_remedy(count))
        return value

    def indices(self, key: str, count: int) -> list[int]:
        """A list of indices into `count` things, empty where the field is absent."""
        values = [_whole(v) for v in self._list(key)]
        good = [v for v in values if v is not None and 0 <= v < count]
        if len(good) != len(values):
            bad = next(i for i, v in enumerate(values) if v is None or not 0 <= v < count)
            raise SceneError(
                f"{self.place(key)}[{bad}]: {_show(self._values[key][bad])}; {_index_remedy(count)}"
            )
        return good

    def number(
        self,
        key: str,
        default: float | None = None,
        *,
        low: float = -math.inf,
        high: float = math.inf,
    ) -> float:
        """A finite number from low to high; required when there is no default."""
        if key not in self._values and default is not None:
            return default
        value = _finite(self._values.get(key))
        if value is None or not low <= value <= high:
            self.fail(key, f"give a finite number{_range(low, high)}")
        return value

    def numbers(
        self,
        key: str,
        default: Sequence[float],
        *,
        low: float = -math.inf,
        high: float = math.inf,
    ) -> tuple[float, ...]:
        """As many finite numbers as the default has."""
        if key not in self._values:
            return tuple(default)
        raw = self._values[key]
        values = [_finite(v) for v in raw] if isinstance(raw, list) else []
        good = tuple(v for v in values if v is not None and low <= v <= high)
        if len(good) != len(default) or len(good) != len(values):
            self.fail(key, f"give {len(default)} finite numbers{_range(low, high)}")
        return good

    def all_numbers(self, key: str) -> tuple[float, ...]:
        """A list of any length of finite numbers, empty where the field is absent."""
        values = [_finite(v) for v in self._list(key)]
        good = tuple(v for v in values if v is not None)
        if len(good) != len(values):
            self.fail(key, "give finite numbers")
        return good

    def text(self, key: str, default: str | None = None) -> str:
        """A string; required when there is no default."""
        value = self._values.get(key, default)
        if not isinstance(value, str):
            self.fail(key, "give a string")
        return value

    def texts(self, key: str) -> list[str]:
        """A list of strings, empty where the field is absent."""
        values = self._list(key)
        if not all(isinstance(v, str) for v in values):
            self.fail(key, "give a list of strings")
        return values

    def flag(self, key: str) -> bool:
        """True or false, false where the field is absent."""
        value = self._values.get(key, False)
        if not isinstance(value, bool):
            self.fail(key, "give true or false")
        return value

    def choice(
        self, key: str, choices: Sequence[_Choice], default: _Choice | None = None
    ) -> _Choice:
        """One of some strings; required when there is no default."""
        value = self._values.get(key, default)
        for choice in choices:
            if value == choice:
                return choice
        self.fail(key, f"give one of {', '.join(choices)}")

    def child(self, key: str) -> Fields:
        """An object that must stand here."""
        if key not in self._values:
            self.fail(key, "give a JSON object")
        return Fields(self._values[key], self.place(key))

    def optional(self, key: str) -> Fields | None:
        """An object, or None where the field is absent."""
        return self.child(key) if key in self._values else None

    def children(self, key: str) -> list[Fields]:
        """A list of objects, empty where the field is absent."""
        place = self.place(key)
        return [Fields(v, f"{place}[{i}]") for i, v in enumerate(self._list(key))]

    def extension(self, name: str) -> Fields | None:
        """The object of a glTF extension, or None where it is absent."""
        extensions = self.optional("extensions")
        return extensions.optional(name) if extensions else None

    def _list(self, key: str) -> list[Any]:
        value = self._values.get(key, [])
        if not isinstance(value, list):
            self.fail(key, "give a list")
        return value


def _whole(value: object) -> int | None:
    if isinstance(value, bool):
        return None
    if isinstance(value, float) and value.is_integer():  # JSON does not tell 3 from 3.0
        return int(value)
    return value if isinstance(value, int) else None


def _finite(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def _index_remedy(count: int) -> str:
    return f"give an index from 0 to {count - 1}" if count else "the file has none of these"


def _range(low: float, high: float) -> str:
    bounds: list[tuple[Literal["from", "to"], float]] = [("from", low), ("to", high)]
    return "".join(f" {word} {bound:g}" for word, bound in bounds if math.isfinite(bound))


def _show(value: object) -> str:
    text = f"'{value}'" if isinstance(value, str) else json.dumps(value)
    return text if len(text) <= _SHOWN else text[: _SHOWN - 1] + "…"

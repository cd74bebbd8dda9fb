"""Arithmetic of 50 digits, so that a number turned into another form and back is the same float.

Forms of other systems are computed exactly and written with as few digits as bring back the very
same profile: a number that a vendor wrote comes out as it stood.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from decimal import Decimal, localcontext
from typing import Any

Numbers = Mapping[str, Decimal]

PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459")
_DIGITS = (15, 16, 17, 20, 25, 30, 40)


@contextmanager
def exactly() -> Iterator[None]:
    """Decimals have 50 digits inside."""
    with localcontext() as context:
        context.prec = 50
        yield


def tan(angle: Decimal) -> Decimal:
    """Tangent of radians, |angle| < π/2, by the series of sine and cosine."""
    sine = cosine = Decimal(0)
    term, n = Decimal(1), 0
    while abs(term) > Decimal("1e-55"):
        if n % 2:
            sine += term if n % 4 == 1 else -term
        else:
            cosine += term if n % 4 == 0 else -term
        n += 1
        term = term * angle / n
    return sine / cosine


def atan(value: Decimal, guess: float) -> Decimal:
    """Arc tangent, from one that is right to float64, by Newton's steps."""
    angle = Decimal(guess)
    for _ in range(3):
        at = tan(angle)
        angle -= (at - value) / (1 + at * at)
    return angle


def shortest(numbers: Numbers, same: Callable[[Numbers], bool]) -> dict[str, Decimal]:
    """The numbers with as few digits as `same` is content with, or all of them."""
    for digits in _DIGITS:
        with localcontext() as context:
            context.prec = digits
            rounded = {name: +value for name, value in numbers.items()}
        if same(rounded):
            return rounded
    return dict(numbers)


def json_text(value: Any) -> str:
    """JSON of plain data in which Decimals keep their digits, one entry of the top a line."""
    lines = (f"  {json.dumps(key)}: {_json(part)}" for key, part in value.items())
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _json(value: Any) -> str:
    if isinstance(value, Decimal):
        with exactly():
            plain = value.normalize()
        return f"{plain:f}" if -8 < plain.adjusted() < 20 else f"{plain:e}"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)}: {_json(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_json, value)) + "]"
    return json.dumps(value)


def read_exact(text: str) -> Any:
    """Data of a JSON text with a Decimal for every number that is no whole one."""
    return json.loads(text, parse_float=Decimal)

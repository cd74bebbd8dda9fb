"""What commands say: messages to stderr, one JSON object to stdout, progress on a terminal only."""

import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any

from lfd_render.errors import OutputError

PROGRAM = "lfd-render"
_STARTED = time.perf_counter()


def say(message: str) -> None:
    """One line to the person, on stderr, if anyone listens."""
    with suppress(OSError):
        print(message, file=sys.stderr, flush=True)


def warn(message: str) -> None:
    """One line about something that the person should know, on stderr."""
    say(f"{PROGRAM}: warning: {one_line(message)}")


def say_error(message: str) -> None:
    """The one line that an error becomes, on stderr."""
    say(f"{PROGRAM}: error: {one_line(message)}")


def one_line(message: str) -> str:
    """The message without line breaks and terminal control codes."""
    joined = " ".join(message.split())
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in joined)


def print_json(result: Mapping[str, Any]) -> None:
    """The one JSON object of a command, on stdout."""
    print_text(json.dumps(result))


def print_text(text: str) -> None:
    """The text that a command was asked for, on stdout."""
    with writing_stdout():
        print(text)


@contextmanager
def writing_stdout() -> Iterator[None]:
    """Turn a closed pipe or a full disk behind stdout into an OutputError."""
    try:
        yield
        sys.stdout.flush()
    except OSError as error:
        raise OutputError(f"stdout: {error.strerror}; keep its reader open") from error


@contextmanager
def progress(message: str) -> Iterator[None]:
    """Show that something is going on, on a terminal only."""
    if not sys.stderr.isatty() or os.environ.get("TERM") == "dumb":
        yield
        return
    from rich.console import Console  # noqa: PLC0415 (slow to import, of no use in a pipe)

    with Console(stderr=True).status(message):
        yield


@contextmanager
def progress_bar(message: str) -> Iterator[Callable[..., None]]:
    """A function that shows the part of a long work that is done, 0 to 1, and a text if given, on a
    terminal only."""
    if not sys.stderr.isatty() or os.environ.get("TERM") == "dumb":
        yield lambda part, text="": None
        return
    from rich.console import Console  # noqa: PLC0415 (slow to import, of no use in a pipe)
    from rich.progress import Progress  # noqa: PLC0415

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(message, total=1.0)
        yield lambda part, text=message: bar.update(task, completed=part, description=text)


class Stopwatch:
    """Named spans of wall clock in milliseconds."""

    def __init__(self) -> None:
        self.timings_ms: dict[str, float] = {}

    @contextmanager
    def span(self, name: str) -> Iterator[None]:
        """Time what runs inside under a name."""
        started = time.perf_counter()
        yield
        self.timings_ms[name] = 1000 * (time.perf_counter() - started)

    def finish(self) -> dict[str, float]:
        """All spans, rounded to a microsecond, with the program's ``total`` so far."""
        self.timings_ms["total"] = 1000 * (time.perf_counter() - _STARTED)
        return {name: round(value, 3) for name, value in self.timings_ms.items()}

"""The command line: its commands, and what an error becomes on stderr and as exit code.

0 ok, 1 internal, 2 usage, 3 scene, 4 profile, 5 GL unavailable, 6 resource limit, 7 input
picture, 8 output, 130 interrupted. ``LFD_DEBUG=1`` shows tracebacks.
"""

import os
import signal
import sys
import traceback
from typing import Annotated

import typer

from lfd_render import __version__
from lfd_render.cli.animate import animate
from lfd_render.cli.bench import bench
from lfd_render.cli.compare import compare
from lfd_render.cli.console import PROGRAM, say_error
from lfd_render.cli.demo import demo
from lfd_render.cli.display import display
from lfd_render.cli.doctor import doctor
from lfd_render.cli.look import look
from lfd_render.cli.quilt import quilt
from lfd_render.cli.render import render
from lfd_render.cli.serve import serve
from lfd_render.cli.unweave import unweave
from lfd_render.cli.video import video
from lfd_render.cli.views import views
from lfd_render.cli.weave import weave
from lfd_render.errors import (
    EXIT_CODES,
    EXIT_INTERNAL,
    EXIT_INTERRUPTED,
    LfdError,
    OptionError,
    ResourceError,
    UsageError,
    exit_code,
)

app = typer.Typer(
    pretty_exceptions_enable=False, context_settings={"help_option_names": ["-h", "--help"]}
)
for command in (
    render, animate, views, quilt, weave, unweave, look, compare, video, bench, serve,
    demo, doctor,
):  # fmt: skip
    app.command()(command)
app.add_typer(display)


def _show_version(asked: bool) -> None:
    if asked:
        print(f"{PROGRAM} {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _program(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    """Light-field rendering for tilted-lenticular displays."""
    if context.invoked_subcommand is None:
        raise UsageError(f"no command given; '{PROGRAM} --help' lists them")


def main() -> int:
    """Run the command line of this process; its exit code."""
    signal.signal(signal.SIGTERM, _end)
    _replace_closed()
    try:
        code = app(prog_name=PROGRAM, standalone_mode=False)
        sys.stdout.flush()
    except (Exception, KeyboardInterrupt) as error:
        if os.environ.get("LFD_DEBUG") == "1":
            traceback.print_exc()
        code, message = describe(error)
        say_error(message)
        _forget_stdout()
    else:
        if code == EXIT_INTERRUPTED:
            say_error("interrupted")
    return int(code or 0)


def _replace_closed() -> None:
    """Put something in the place of streams that were closed before the program started: a stdout
    that cannot be written, so that asking for it is an error, and a stderr that nobody reads."""
    if sys.stdout is None:
        sys.stdout = os.fdopen(os.open(os.devnull, os.O_RDONLY), "w")
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 (for the process)


def _end(number: int, _frame: object) -> None:
    """End by an exception, so that unfinished files are removed."""
    raise SystemExit(128 + number)


def describe(error: BaseException) -> tuple[int, str]:
    """Exit code and one line of an error."""
    if isinstance(error, OptionError):
        return exit_code(error), f"--{error.option.replace('_', '-')}: {error.reason}"
    if isinstance(error, LfdError):
        return exit_code(error), str(error)
    if isinstance(error, KeyboardInterrupt):
        return EXIT_INTERRUPTED, "interrupted"
    if isinstance(error, MemoryError):
        code = EXIT_CODES[ResourceError]
        return code, f"out of memory: {error}; use a smaller scene or view size"
    # Depending on its version, Typer brings or imports Click: its usage errors have no one class.
    if hasattr(error, "format_message"):
        return EXIT_CODES[UsageError], error.format_message()
    kind = type(error).__name__
    return EXIT_INTERNAL, f"internal error: {kind}: {error} (LFD_DEBUG=1 shows where)"


def _forget_stdout() -> None:
    """Keep the interpreter from flushing to a pipe that nobody reads when it ends."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


if __name__ == "__main__":
    sys.exit(main())

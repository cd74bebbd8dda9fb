"""`lfd-render display`: what is known of displays, and how it is told to others.

Each sub-command is a function of its own file, `cli/display_*.py`, and hooked in here.
"""

from __future__ import annotations

import typer

from lfd_render.cli.console import PROGRAM
from lfd_render.cli.display_calibrate import calibrate
from lfd_render.cli.display_fit import fit
from lfd_render.cli.display_maps import diff, view_map
from lfd_render.cli.display_pattern import pattern
from lfd_render.cli.display_profiles import convert, list_displays, show, validate
from lfd_render.errors import UsageError

display = typer.Typer(name="display", help="Profiles of displays: show, check, convert, measure.")

display.command("list")(list_displays)
for command in (show, validate, convert, diff, pattern, fit, calibrate):
    display.command()(command)
display.command("map")(view_map)


@display.callback(invoke_without_command=True)
def _group(context: typer.Context) -> None:
    if context.invoked_subcommand is None:
        raise UsageError(f"no command given; '{PROGRAM} display --help' lists them")

"""`lfd-render serve`: the HTTP service."""

from __future__ import annotations

from typing import Annotated

import typer

from lfd_render.cli import options
from lfd_render.cli.console import say


def serve(
    *,
    host: Annotated[str | None, typer.Option(help="Address to listen on.")] = None,
    port: Annotated[
        int | None, typer.Option(min=0, max=65535, help="Port to listen on; 0: any that is free.")
    ] = None,
    processes: Annotated[
        int | None, typer.Option(min=1, help="Render processes, each with one GL context.")
    ] = None,
    device: Annotated[
        str | None,
        typer.Option(
            metavar="auto|gpu|software|INDEX",
            help="OpenGL device; an index is that of 'lfd-render doctor'.",
        ),
    ] = None,
    data_dir: Annotated[
        str | None,
        typer.Option(metavar="FOLDER", help="Where scenes and displays stay over restarts."),
    ] = None,
) -> None:
    """Serve panel images over HTTP; docs/service.md lists the settings of the environment."""
    if device is not None:
        options.check_device(device)

    from lfd_render.service.run import run  # noqa: PLC0415 (keeps --help quick)
    from lfd_render.service.settings import Settings  # noqa: PLC0415

    run(
        Settings.from_environment(
            host=host, port=port, processes=processes, device=device, data_dir=data_dir
        ),
        say,
    )

"""The README's lines about the server work as they stand there, and docs/service.md says it all."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from lfd_render.service.settings import Settings

from .conftest import Server, Start
from .readme import REPOSITORY, run_readme


@pytest.fixture(scope="module")
def server(start: Start) -> Iterator[Server]:
    with start() as server:
        yield server


@pytest.mark.needs("gl", "curl")
@pytest.mark.shows("the README's curl lines give the command line's EIA, bit for bit")
def test_the_readmes_lines_give_the_command_lines_picture(
    server: Server, triangle: bytes, tmp_path: Path
) -> None:
    run_readme(server.url, triangle, tmp_path)


def test_all_settings_are_told() -> None:
    told = (REPOSITORY / "docs" / "service.md").read_text(encoding="utf-8")
    missing = [row for row in Settings.table() if row not in told]
    assert not missing, "docs/service.md should have\n" + "\n".join(missing)

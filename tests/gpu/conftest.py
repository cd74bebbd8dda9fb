"""What tests with the device share."""

from collections.abc import Iterator

import pytest

from lfd_render import Renderer
from lfd_render.gpu.device import Device


@pytest.fixture(scope="module")
def renderer(device: Device) -> Iterator[Renderer]:
    """One for all of a module, so that what it has uploaded is there for the next test."""
    with Renderer(device) as renderer:
        yield renderer

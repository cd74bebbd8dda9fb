"""What a render process does besides rendering."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lfd_render.display import DisplayProfile
from lfd_render.engine import encoding
from lfd_render.engine.jobs import AllViews, Job, SceneSource
from lfd_render.engine.workshop import Workshop
from lfd_render.errors import CancelledError

SCENE = SceneSource("chart", "builtin:chart?triangles=1000", "chart")


def test_an_archive_is_called_off_between_its_views(monkeypatch: pytest.MonkeyPatch) -> None:
    profile = DisplayProfile.load("gavane-2024-tilted-4k")
    views = np.zeros((6, 4, 4, 3), np.uint8)
    renderer: Any = SimpleNamespace(
        views=lambda *_, **__: views, device=SimpleNamespace(name="none"), warnings=()
    )
    encoded = 0

    def counted(*_: object) -> bytes:
        nonlocal encoded
        encoded += 1
        return b""

    def progress(part: float) -> None:
        if encoded == 2:
            raise CancelledError("called off")

    monkeypatch.setattr(encoding, "encoded", counted)
    with pytest.raises(CancelledError):
        Workshop(renderer, 1 << 20, 0).make(Job(AllViews(), encoding.ZIP, SCENE, profile), progress)
    assert encoded == 2

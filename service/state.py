"""What the parts of a running service share."""

from __future__ import annotations

from asyncio import Event
from dataclasses import dataclass, field
from typing import Annotated, cast

from fastapi import Depends
from starlette.requests import HTTPConnection

from lfd_render.engine.lru import ByteLru
from lfd_render.engine.pool import Pool

from .clients import Slots
from .display_store import DisplayStore
from .job_store import JobStore
from .metrics import Metrics
from .picture import Picture
from .scene_store import SceneStore
from .settings import Settings


@dataclass(frozen=True)
class State:
    """Everything that handlers need."""

    settings: Settings
    pool: Pool
    scenes: SceneStore
    displays: DisplayStore
    jobs: JobStore
    answers: ByteLru[Picture]
    metrics: Metrics
    streams: Slots
    ending: Event = field(default_factory=Event)  # the server is told to end


def state_of(connection: HTTPConnection) -> State:
    """The state of the application that serves a request or a socket."""
    return cast(State, connection.app.state.lfd)


Shared = Annotated[State, Depends(state_of)]

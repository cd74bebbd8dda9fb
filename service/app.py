"""The application: ``uvicorn --factory lfd_render.service.app:create_app``."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from starlette.middleware.cors import CORSMiddleware

from lfd_render.engine.lru import ByteLru
from lfd_render.engine.pool import Pool
from lfd_render.errors import LfdError
from lfd_render.version import __version__

from . import calibration, displays, health, jobs, page, pictures, problems, scenes, streams
from .clients import Slots
from .data_folder import data_folder
from .display_store import DisplayStore
from .ending import tell_of_signals
from .guards import Bodies, Keys, SameSite
from .job_store import JobStore
from .journal import Journal, log_json
from .metrics import Metrics
from .picture import Picture
from .scene_store import SceneStore
from .settings import Settings
from .state import State

_DESCRIPTION = """
Panel images (EIA) of 3D scenes for tilted-lenticular light-field displays.

Options are those of the `lfd-render` command, with underscores. `Accept` chooses the format; an
unchanged picture is answered 304 by its `ETag`. Errors are `application/problem+json`.
"""
_ALLOWED = [
    "Authorization", "X-API-Key", "X-Request-Id", "Content-Type", "If-None-Match", "Prefer",
    "Idempotency-Key",
]  # fmt: skip
_EXPOSED = ["ETag", "Server-Timing", "Location", "Retry-After", "LFD-Size", "LFD-Warnings"]


def create_app(settings: Settings | None = None) -> FastAPI:
    """The application with these settings, by default the environment's. Raises UsageError."""
    chosen = settings or Settings.from_environment()
    log_json(chosen.log_level)
    answers: ByteLru[Picture] = ByteLru(chosen.answer_cache_mb << 20)
    pool = Pool(chosen.pool, answers.clear)
    streaming = Slots(chosen.max_streams)
    metrics = Metrics(pool, streaming)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        try:
            async with _running(chosen, pool, answers, metrics, streaming) as app.state.lfd:
                tell_of_signals(app.state.lfd.ending)
                app.openapi()  # made once: for a third of a second nobody is served
                yield
        except LfdError as error:
            app.state.failure = error
            raise

    app = FastAPI(
        title="lfd_render",
        version=__version__,
        description=_DESCRIPTION,
        lifespan=lifespan,
        docs_url=None,  # their viewers come from elsewhere
        redoc_url=None,
    )
    app.state.failure = None  # why it could not start
    parts = (health, scenes, pictures, jobs, streams, displays, calibration, page)
    routers = [part.router for part in parts]
    problems.install(app, [route for router in routers for route in router.routes])
    for router in routers:
        app.include_router(router)
    # The last one added is the outermost.
    app.add_middleware(Bodies, settings=chosen)
    app.add_middleware(Keys, settings=chosen)
    if chosen.cors_origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=chosen.cors_origins,
            allow_methods=["GET", "HEAD", "POST", "PUT", "DELETE"],
            allow_headers=_ALLOWED,
            expose_headers=_EXPOSED,
        )
    app.add_middleware(SameSite, settings=chosen)
    app.add_middleware(Journal, metrics=metrics)
    vars(app)["openapi"] = lambda: _openapi(app)  # as FastAPI would have it
    return app


@asynccontextmanager
async def _running(
    settings: Settings, pool: Pool, answers: ByteLru[Picture], metrics: Metrics, streaming: Slots
) -> AsyncIterator[State]:
    """What handlers share, from the first render process to the last. Raises LfdError."""
    with data_folder(settings.data_dir) as folder:
        stored = SceneStore(folder / "scenes", settings)
        jobs_made = JobStore(folder / "jobs", settings, pool, stored)
        kept = DisplayStore(folder / "displays", settings.max_displays)
        await pool.start()
        try:
            yield State(settings, pool, stored, kept, jobs_made, answers, metrics, streaming)
        finally:
            await jobs_made.close()
            await pool.drain(settings.drain_s)
            await pool.close()


def _openapi(app: FastAPI) -> dict[str, Any]:
    """The description, with the schema that problems refer to."""
    if not app.openapi_schema:
        made = get_openapi(
            title=app.title, version=app.version, description=app.description, routes=app.routes
        )
        made["components"]["schemas"]["Problem"] = problems.Problem.model_json_schema()
        app.openapi_schema = made
    return app.openapi_schema

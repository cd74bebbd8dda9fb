"""From what a request says of a picture to the job that makes it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from lfd_render.display import Camera, DisplayProfile
from lfd_render.engine import encoding
from lfd_render.engine.jobs import AllViews, Job, PanelImage, SceneSource
from lfd_render.engine.plans import check_picture, check_plan

from .fields import AnyBody, AnyQuery, EiaFields, Views
from .media import choose
from .state import State

PICTURES = (encoding.PNG, encoding.WEBP, encoding.JPEG, encoding.RAW)
PANEL = (encoding.PNG, encoding.WEBP, encoding.EXR, encoding.RAW)


@contextmanager
def of_query(
    state: State, scene: str, query: AnyQuery, accept: str | None, *, later: bool = False
) -> Iterator[Job]:
    """The job of a query, whose scene stays meanwhile. later: whether it is done in the background,
    where it may take more.

    Raises ProblemError and LfdError for what makes none.
    """
    display = state.displays.get(query.display)
    with state.scenes.source(scene) as source:
        yield _job(state, query, accept, later, source=source, display=display, camera=query.camera)


@contextmanager
def of_body(
    state: State, body: AnyBody, accept: str | None, *, later: bool = False
) -> Iterator[Job]:
    """The job of a JSON body, as `of_query` has it."""
    camera = body.camera
    display = state.displays.told(body.display)
    window = Camera.from_json_dict(camera) if isinstance(camera, dict) else camera
    with state.scenes.source(body.scene) as source:
        yield _job(state, body, accept, later, source=source, display=display, camera=window)


def _job(
    state: State,
    fields: Views,
    accept: str | None,
    later: bool,
    *,
    source: SceneSource,
    display: DisplayProfile,
    camera: str | Camera | None,
) -> Job:
    media = choose(accept, _offered(fields))
    job = Job(fields.product, media, source, display, fields.choices(camera))
    settings = state.settings
    check_plan(job, settings.max_job_view_pixels if later else settings.max_view_pixels)
    check_picture(job, settings.max_picture_pixels)
    return job


def _offered(fields: Views) -> Sequence[str]:
    """Media types in which a picture is to be had."""
    if isinstance(fields.product, PanelImage):
        return (*PANEL, encoding.JPEG) if isinstance(fields, EiaFields) and fields.lossy else PANEL
    return (encoding.ZIP,) if isinstance(fields.product, AllViews) else PICTURES

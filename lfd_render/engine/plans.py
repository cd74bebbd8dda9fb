"""What a job would take, told before it is queued."""

from __future__ import annotations

from lfd_render.display import DisplayProfile
from lfd_render.engine import encoding
from lfd_render.engine.jobs import (
    AllViews,
    Job,
    OneView,
    PanelImage,
    Pattern,
    QuiltPicture,
    SceneFacts,
    Seen,
    ViewMap,
)
from lfd_render.engine.quilts import chosen_size
from lfd_render.errors import ResourceError, SizeError
from lfd_render.panel.eyes import stands
from lfd_render.panel.look import seen_size
from lfd_render.panel.picture import GAP_PX
from lfd_render.renderer import RenderOptions, upright_size
from lfd_render.renderer.plan import plan_panel


def check_plan(job: Job, most_pixels: int) -> None:
    """Raise what the job's options would raise when it runs, and ResourceError for more pixels of
    all views, samples counted, than allowed."""
    display = _display(job)
    choice = RenderOptions(**job.choices.options())
    match job.product:
        case PanelImage() | Seen():
            plan = plan_panel(display, choice)
            pixels = plan.rig.views * plan.rendered.columns * plan.rendered.rows
        case QuiltPicture(device, tiles, size):
            quilt = chosen_size(display, device, tiles, size)
            pixels = quilt.width_px * quilt.height_px * _samples(choice)
        case AllViews() | OneView():
            width, height = _view_size(job)
            pixels = _shown(job) * width * height * _samples(choice)
        case _:
            return
    if pixels > most_pixels:
        raise ResourceError(
            f"views: {pixels} pixels of all of them, samples counted; the limit is {most_pixels}, "
            "ask for fewer or smaller views"
        )


def check_picture(job: Job, most_pixels: int) -> None:
    """Raise SizeError for a panel image or an encoded picture of more pixels than allowed, or than
    its format holds."""
    option, width, height = _picture(job)
    of_panel = isinstance(job.product, PanelImage | Seen | Pattern | ViewMap)
    for name, across, down in [("display", *_display(job).resolution_px)] * of_panel + [
        (option, width, height)
    ]:
        if across * down > most_pixels:
            raise SizeError(
                name,
                f"a picture of {across} x {down} is {across * down} pixels; the limit is "
                f"{most_pixels}, ask for a smaller one",
            )
    side = encoding.MOST_SIDE.get(job.media)
    if side is not None and max(width, height) > side:
        raise SizeError(
            option,
            f"a picture of {width} x {height}; {job.media} holds {side} pixels a side, ask for "
            f"{encoding.PNG}",
        )


def encoding_seconds(job: Job) -> float:
    """How long one encoding of the job may take before its process is thought to hang."""
    if isinstance(job.product, SceneFacts):
        return 0.0
    _, width, height = _picture(job)
    return encoding.most_seconds(job.media, width * height)


def _picture(job: Job) -> tuple[str, int, int]:
    """The option that decides the size of an encoded picture, its width and its height."""
    display = _display(job)
    match job.product:
        case Seen() as seen:
            eyes = len(stands(display, seen.angle, seen.eye, seen.sweep)) * (1 + seen.stereo)
            width, height = seen.size or _seen_size(job)
            return "sweep" if seen.sweep else "size", eyes * (width + GAP_PX) - GAP_PX, height
        case QuiltPicture(device, tiles, size):
            quilt = chosen_size(display, device, tiles, size)
            return "size", quilt.width_px, quilt.height_px
        case AllViews() | OneView():
            return ("view_size", *_view_size(job))
        case Pattern(through=DisplayProfile() as through, size=size):
            return ("size", *(size or seen_size(through, through.views)))
        case _:
            return ("display", *display.resolution_px)


def _seen_size(job: Job) -> tuple[int, int]:
    """What an eye's picture is where no size is asked for."""
    display = _display(job)
    plan = plan_panel(display, RenderOptions(**job.choices.options()))
    return seen_size(display, plan.views if plan.rows_follow_views else display.views)


def _view_size(job: Job) -> tuple[int, int]:
    """Columns and rows of an upright view."""
    return job.choices.view_size or upright_size(_display(job), _views(job))


def _shown(job: Job) -> int:
    return _views(job) if isinstance(job.product, AllViews) else 1


def _views(job: Job) -> int:
    assert job.choices.views != "continuous"
    return job.choices.views or _display(job).views


def _display(job: Job) -> DisplayProfile:
    assert job.display is not None
    return job.display


def _samples(choice: RenderOptions) -> int:
    """Samples of a view's pixel."""
    each_way, eyes = choice.supersample
    return each_way * each_way * eyes

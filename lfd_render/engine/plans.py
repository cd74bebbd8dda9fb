"""What a job would take, told before it is queued."""

from __future__ import annotations

from lfd_render.engine.jobs import AllViews, Job, OneView, PanelImage, QuiltPicture, Seen
from lfd_render.engine.quilts import chosen_size
from lfd_render.errors import ResourceError
from lfd_render.panel.eyes import stands
from lfd_render.renderer import RenderOptions, upright_size
from lfd_render.renderer.plan import plan_panel


def check_plan(job: Job, most_pixels: int) -> None:
    """Raise what the job's options would raise when it runs, and ResourceError for more pixels of
    all views, samples counted, than allowed."""
    assert job.display is not None
    choice = RenderOptions(**job.choices.options())
    match job.product:
        case PanelImage() | Seen():
            if isinstance(job.product, Seen):
                stands(job.display, job.product.angle, job.product.eye, job.product.sweep)
            plan = plan_panel(job.display, choice)
            pixels = plan.rig.views * plan.rendered.columns * plan.rendered.rows
        case QuiltPicture(device, tiles, size):
            quilt = chosen_size(job.display, device, tiles, size)
            pixels = quilt.width_px * quilt.height_px * _samples(choice)
        case AllViews() | OneView():
            assert choice.views != "continuous"
            count = choice.views or job.display.views
            width, height = choice.view_size or upright_size(job.display, count)
            shown = count if isinstance(job.product, AllViews) else 1
            pixels = shown * width * height * _samples(choice)
        case _:
            return
    if pixels > most_pixels:
        raise ResourceError(
            f"views: {pixels} pixels of all of them, samples counted; the limit is {most_pixels}, "
            "ask for fewer or smaller views"
        )


def _samples(choice: RenderOptions) -> int:
    """Samples of a view's pixel."""
    each_way, eyes = choice.supersample
    return each_way * each_way * eyes

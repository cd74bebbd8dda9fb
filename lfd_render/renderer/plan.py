"""Which eyes and pixels a call renders, and how they become the views that are woven."""

from __future__ import annotations

from dataclasses import dataclass, replace

from lfd_render.display import DisplayProfile, Reconstruction, Rig, ViewGrid
from lfd_render.errors import UsageError
from lfd_render.renderer.options import MOST_VIEWS, RenderOptions

# With so many eyes a view, each subpixel's own angle is within 1/16 of a view interval of an eye's.
CONTINUOUS_EYES = 8
GOLD_VIEWS = 96
GOLD_SAMPLES = 32


@dataclass(frozen=True, eq=False)
class ViewPlan:
    """rig: all eyes, `eyes` of them a view; rendered: their pixels; grid: the pixels of the views
    that are woven; rule: how."""

    rig: Rig
    rendered: ViewGrid
    grid: ViewGrid
    rule: Reconstruction
    eyes: int = 1

    @property
    def views(self) -> int:
        """How many views are woven."""
        return self.rig.views // self.eyes

    @property
    def rows_follow_views(self) -> bool:
        """Whether all views together hold as many pixels as the panel, as the display drives them:
        not where angles or pixels are finer than that."""
        return self.rule.view == 1.0 and self.rule.samples != GOLD_SAMPLES

    @property
    def times(self) -> int:
        """How many rendered rows and columns are averaged to one of the views."""
        return self.rendered.rows // self.grid.rows

    @property
    def halo(self) -> int:
        """Rendered rows around those shown that the filter reaches."""
        return self.rule.halo * self.times


def plan_panel(display: DisplayProfile, choice: RenderOptions) -> ViewPlan:
    """What a panel image takes."""
    fineness, eyes = choice.supersample
    count, views_apart = _view_count(display, choice)
    grid = _grid(display, choice, count)
    rule = Reconstruction(choice.lookup, choice.weave, choice.filter, view=views_apart)
    if choice.preset == "gold":
        rule = replace(rule, samples=GOLD_SAMPLES, pixel=_pixel_of(display, grid))
    if not rule.spatial:
        fine = grid.finer(display, fineness)
    else:  # the filter averages
        fine = grid = grid.finer(display, fineness)
        rule = replace(rule, pixel=(rule.pixel[0] * fineness, rule.pixel[1] * fineness))
    rig = display.rig(count, choice.spacing)
    if eyes > 1:
        rig = Rig.jittered(display, count, eyes, choice.seed, choice.spacing)
    return ViewPlan(rig, fine, grid, rule, eyes)


def plan_views(
    display: DisplayProfile, choice: RenderOptions, rig: Rig | None, size: tuple[int, int]
) -> ViewPlan:
    """What single upright views of a size take; rig: other eyes than the display's.

    Raises UsageError for what makes a panel image of views.
    """
    if choice.preset == "gold":
        raise UsageError("preset 'gold': is for panel images; use it with render")
    fineness, eyes = choice.supersample
    grid = ViewGrid.upright(display, *size)
    if rig is None:
        count, _ = _view_count(display, choice)
        rig = display.rig(count, choice.spacing)
        if eyes > 1:
            rig = Rig.jittered(display, count, eyes, choice.seed, choice.spacing)
    return ViewPlan(rig, grid.finer(display, fineness), grid, Reconstruction(), eyes)


def upright_size(display: DisplayProfile, views: int) -> tuple[int, int]:
    """Width and height of upright views: one column a lens, all views together as large as the
    panel."""
    rows = ViewGrid.default_rows(display, views)
    width, height = display.resolution_px
    return max(1, round(width * height / (views * rows))), rows


def _view_count(display: DisplayProfile, choice: RenderOptions) -> tuple[int, float]:
    """How many views are woven, and how many of them are one view interval of the display's."""
    if choice.views == "continuous":
        count = min(CONTINUOUS_EYES * display.views, MOST_VIEWS)
        return count, count / display.views
    if choice.views is None:
        return (GOLD_VIEWS if choice.preset == "gold" else display.views), 1.0
    return choice.views, 1.0


def _grid(display: DisplayProfile, choice: RenderOptions, count: int) -> ViewGrid:
    if choice.view_size is not None:
        return ViewGrid.upright(display, *choice.view_size)
    if choice.preset == "gold":
        return ViewGrid.upright(display, *display.resolution_px)
    views = display.views if choice.views == "continuous" else count
    if choice.preset == "paper":
        return ViewGrid.upright(display, *upright_size(display, views))
    rows = ViewGrid.default_rows(display, views)
    return (ViewGrid.sheared if choice.technique == "mvr" else ViewGrid.lens)(display, rows)


def _pixel_of(display: DisplayProfile, grid: ViewGrid) -> tuple[float, float]:
    """Columns a lens, and rows a row of the views that the display is driven with."""
    rows = ViewGrid.default_rows(display, display.views)
    return grid.columns_at(display)[0], grid.rows / rows

"""The filter's samples are Gaussian, even, and never all outside the views."""

import numpy as np
import pytest

from lfd_render.display import Reconstruction
from lfd_render.display.reconstruction import gaussian_samples


@pytest.mark.parametrize("count", [8, 16, 32])
def test_samples_have_the_papers_widths(count: int) -> None:
    samples = gaussian_samples(count)
    radius = np.hypot(samples[:, 0], samples[:, 1])
    assert radius.max() <= 2.25 / 2
    assert np.abs(samples[:, 2]).max() <= 1.0
    np.testing.assert_allclose(samples.mean(axis=0), 0.0, atol=1e-15)
    # Deviation of a Gaussian disc cut at 2σ: σ·√(1 − 2/(e² − 1)); of a Gaussian so cut, 0.880 σ.
    # Samples stand at the middles of equal parts, whose outer tails they make too short.
    disc = 2.25 / 4 * np.sqrt(1 - 2 / (np.exp(2) - 1))
    np.testing.assert_allclose(samples.std(axis=0), [disc, disc, 0.44], rtol=0.08)
    correlation = np.corrcoef(samples.T) - np.eye(3)
    assert np.abs(correlation).max() < 0.3


def test_the_set_is_fixed() -> None:
    np.testing.assert_allclose(gaussian_samples(8)[0], [0.24856, 0.10296, 0.07505], atol=1e-5)
    assert not gaussian_samples(8).flags.writeable


@pytest.mark.parametrize("count", [8, 32])
def test_some_sample_is_inside_however_few_the_views(count: int) -> None:
    """One row of one view, the subpixel anywhere in it."""
    place = (np.arange(200) + 0.5) / 200
    row, view = np.meshgrid(place, place)
    samples = gaussian_samples(count)
    inside = np.zeros(row.shape, bool)
    for _, rows, views in samples:
        inside |= (np.floor(row + rows) == 0) & (np.floor(view + views) == 0)
    assert inside.all()


def test_offsets_follow_the_axes_that_are_filtered() -> None:
    assert (Reconstruction().offsets() == 0).all()
    assert (Reconstruction(aa="angular").offsets()[:, :2] == 0).all()
    assert (Reconstruction(aa="spatial").offsets()[:, 2] == 0).all()
    wide = Reconstruction(aa="both", pixel=(8.0, 6.0), view=2.0)
    np.testing.assert_allclose(wide.offsets(), Reconstruction(aa="both").offsets() * [8, 6, 2])
    assert wide.halo == 7

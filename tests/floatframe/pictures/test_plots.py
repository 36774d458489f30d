"""Plots show what the trajectory holds."""

from dataclasses import replace
from types import SimpleNamespace

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.testing import assert_allclose, assert_array_equal

from floatframe import GeneralizedAlpha, integrate
from floatframe.pictures import plots
from floatframe.results.sensor_plots import LIKELY, pages_of
from floatframe.results.trajectory import Trajectory
from tests.floatframe.results.examples import SYSTEM

mpl.use("Agg")


@pytest.fixture(scope="module")
def motion():
    return integrate(SYSTEM, GeneralizedAlpha(), 0.05, 1e-3)


@pytest.fixture(autouse=True)
def _closed():
    import matplotlib.pyplot as plt

    yield
    plt.close("all")


def test_energies_are_drawn_over_time_and_zero_ones_left_out(motion):
    ax = plots.plot_energies(motion)
    labels = [line.get_label() for line in ax.get_lines()]
    assert labels == ["kinetic", "strain", "gravity", "total"]
    assert_array_equal(ax.get_lines()[3].get_ydata(), motion.energies.total)
    assert ax.get_xlabel() == "time [s]"
    assert ax.get_ylabel() == "energy [N m]"


@pytest.mark.parametrize("plot", [plots.plot_drift, plots.plot_energy_balance])
def test_every_plot_of_the_whole_motion_has_lines_and_labels(motion, plot):
    ax = plot(motion)
    assert ax.get_lines()
    assert ax.get_ylabel()


def test_drift_that_is_rounding_beside_the_largest_is_counted_and_not_drawn(motion, monkeypatch):
    size = np.linspace(0.0, 1.0, len(motion.t))
    monkeypatch.setattr(
        Trajectory, "drift", lambda self, name: SimpleNamespace(distance=1e-9 * size, angle=-1e-16 * size)
    )
    ax = plots.plot_drift(motion)
    line, _ = ax.get_lines()  # of two joints, the distances alone
    assert_array_equal(np.asarray(line.get_ydata())[1:], 1e-9 * size[1:])
    assert ax.get_title(loc="right") == "the largest 2 of 4"


def test_the_drift_of_many_joints_is_not_hidden_under_its_legend(motion, monkeypatch):
    """Forty errors of like size: eight are drawn, below the legend."""
    t = np.linspace(0.0, 1.0, len(motion.t))
    names = tuple(f"joint of a long name {k}" for k in range(20))
    errors = {name: 1e-9 * (1 + 0.1 * k) * (2 + np.sin(30 * t + k)) for k, name in enumerate(names)}
    monkeypatch.setattr(
        Trajectory, "drift", lambda self, name: SimpleNamespace(distance=errors[name], angle=errors[name])
    )
    ax = plots.plot_drift(Trajectory(replace(motion.head, joints=names), motion.source, is_complete=True))
    assert len(ax.lines) == 8
    assert ax.get_title(loc="right") == "the largest 8 of 40"
    assert covered(ax.figure) == []


def test_no_legend_of_an_overview_covers_a_curve():
    """Without the room above, the legend of a motion that fills its panel covers it."""
    t = np.linspace(0.0, 1.0, 2000)

    def fill(ax):
        for k in range(5):
            ax.plot(t, np.sin(200 * t + k), label=f"curve {k}")
        ax.set(xlabel="time", ylabel="value")
        ax.legend()
        return ax

    alone = fill(Figure(layout="constrained").add_subplot())
    assert covered(alone.figure) == [alone]
    for n_panels in (1, 3, 8):
        (page,) = pages_of([fill] * n_panels, title="a title")
        assert len(page.axes) == n_panels
        assert covered(page) == []


def test_the_layout_of_a_page_hardly_changes_the_sizes_of_its_panels():
    for n_panels, words in ((1, ""), (2, "panel"), (3, ""), (8, "two\nlines")):
        (page,) = pages_of(
            [lambda ax, w=words: ax.set(xlabel="time", ylabel="value", title=w)] * n_panels, title="a title"
        )
        before = [ax.get_window_extent().frozen() for ax in page.axes]
        page.draw_without_rendering()
        for old, ax in zip(before, page.axes, strict=True):
            new = ax.get_window_extent()
            assert_allclose([new.width / old.width, new.height / old.height], 1, rtol=0, atol=LIKELY - 1)


def covered(figure):
    """Return the axes whose legend covers a point of a curve."""
    figure.draw_without_rendering()
    return [
        ax
        for ax in figure.axes
        for box in [ax.get_legend().get_window_extent()]
        if any(box.count_contains(ax.transData.transform(line.get_xydata())) for line in ax.get_lines())
    ]

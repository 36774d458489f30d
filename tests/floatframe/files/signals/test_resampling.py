"""Resampling, filters and drift: what is kept, and what is said about the rest."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import PchipInterpolator

from floatframe.errors import SignalError
from floatframe.files.signals import Signal, filtered, integrated_twice, resampled, without_drift
from floatframe.files.signals.analysis import even_signals
from floatframe.files.signals.signals import Signals
from floatframe.model.functions.tables import acceleration_table

RATE = 2000.0
t = np.arange(4001) / RATE


def sines(unit="m/s^2", high=0.0, at=600.0):
    return Signal("road", t, np.sin(2 * np.pi * 40 * t) + high * np.sin(2 * np.pi * at * t), unit)


@pytest.mark.parametrize("rate", [500.0, 512.0, 333.3, 2000.0, 2500.0, 6000.0])
def test_what_lies_below_the_new_nyquist_frequency_stays(rate):
    found, report = resampled(sines(high=0.5), rate)
    keeps_high = rate > 1999
    expected = np.sin(2 * np.pi * 40 * found.time) + (0.5 * np.sin(2 * np.pi * 600 * found.time) if keeps_high else 0)
    assert_allclose(found.values[100:-100], expected[100:-100], rtol=0, atol=0.02 if keeps_high else 2e-4)
    assert_allclose(np.diff(found.time), 1 / rate, rtol=1e-9, atol=0)
    assert_allclose([report.rate_before, report.rate_after], [RATE, rate], rtol=1e-9, atol=0)
    part = 0.0 if keeps_high else 0.25 / 1.25
    assert_allclose(report.above_nyquist, part, rtol=2e-3, atol=1e-12)
    rms = np.sqrt(0.5 * (1.25 if keeps_high else 1.0))
    assert_allclose([report.rms_before, report.rms_after], [np.sqrt(0.5 * 1.25), rms], rtol=4e-3, atol=0)


def test_every_fourth_sample_is_taken_as_it_is():
    """Without a filter; an interpolation would smooth the edges of a rectangular wave."""
    wave = Signal("switch", t, np.where(t % 0.1 < 0.05, 1.0, -1.0), "V")
    found, _ = resampled(wave, RATE / 4, anti_alias=False)
    assert_allclose(found.values, wave.values[::4], rtol=0, atol=0)


@pytest.mark.parametrize("above", [1.0, 1.02, 1.05, 1.5])
def test_from_the_new_nyquist_frequency_on_nothing_is_left(above):
    """-80 dB at the end of the transition, which begins at 80 % of the new Nyquist frequency."""
    rate = 500.0
    whine = Signal("whine", t, np.sin(2 * np.pi * above * rate / 2 * t + 0.4), "m/s^2")
    found, _ = resampled(whine, rate)
    inner = slice(100, -100)
    assert np.abs(found.values[inner]).max() < 3e-4
    kept = Signal("hum", t, np.sin(2 * np.pi * 0.8 * rate / 2 * t), "m/s^2")
    found, _ = resampled(kept, rate)
    assert_allclose(found.values[inner], np.sin(2 * np.pi * 200 * found.time)[inner], rtol=0, atol=3e-4)


def test_the_filter_is_as_long_as_kaisers_formula_asks():
    """(80 - 7.95) / (2.285 pi 0.1) + 1 is 101.4; the next odd number of taps is 103, 51 on each side of a sample."""
    impulse = Signal("a", t, (np.arange(len(t)) == 2001).astype(float), "m/s^2")
    found, _ = resampled(impulse, RATE / 2)
    reached = 2 * np.flatnonzero(np.abs(found.values) > 1e-9)
    assert [reached.min(), reached.max()] == [2001 - 51, 2001 + 51]


@pytest.mark.parametrize("rate", [500.0, 333.3, 2000.0, 6000.0])
def test_new_samples_reach_the_last_old_time_and_not_beyond(rate):
    found, _ = resampled(sines(), rate)
    assert found.time[0] == 0.0
    assert 0 <= t[-1] - found.time[-1] < (1 - 1e-6) / rate


def test_without_the_filter_what_lies_above_is_mirrored():
    found, _ = resampled(sines(high=0.5), 500.0, anti_alias=False)
    expected = np.sin(2 * np.pi * 40 * found.time) + 0.5 * np.sin(2 * np.pi * 100 * found.time)  # 600 - 500
    assert_allclose(found.values, expected, rtol=0, atol=1e-9)


def test_the_report_is_about_the_acceleration_of_a_position():
    """Of a displacement the part above weighs with the fourth power of its frequency in the mean square."""
    _, report = resampled(sines("mm", high=0.01, at=350.0), 500.0)
    weights = np.array([1.0, (0.01 * (350 / 40) ** 2) ** 2])
    assert report.of == "acceleration"
    assert_allclose(report.above_nyquist, weights[1] / weights.sum(), rtol=0.02, atol=0)
    assert_allclose(report.rms_before / report.rms_after, np.sqrt(weights.sum() / weights[0]), rtol=0.02, atol=0)
    assert "peak acceleration -" in report.description
    assert "lay above 250 Hz" in report.description


@pytest.mark.parametrize(("unit", "power"), [("mm", 3), ("deg", 3), ("m/s", 2), ("rad/s", 2), ("g", 1)])
def test_the_report_has_the_largest_acceleration_where_it_is_at_an_end(unit, power):
    """The acceleration of t³, of the rate t² and of t itself is straight; a spline of fifth order repeats it."""
    a = {3: 6.0, 2: 2.0, 1: 1.0}[power] * t
    _, report = resampled(Signal("a", t, t**power, unit), RATE / 2, anti_alias=False)
    assert report.of == "acceleration"
    sizes = [report.peak_before, report.peak_after, report.rms_before, report.rms_after]
    rms = [np.sqrt(np.mean(x**2)) for x in (a, a[::2])]
    assert_allclose(sizes, [a[-1], a[-1], *rms], rtol=1e-5, atol=0)


def test_uneven_times_become_even_and_that_is_said():
    uneven = np.sort(np.random.default_rng(0).uniform(0, 2, 3000))
    found, _ = resampled(Signal("road", uneven, np.sin(20 * uneven), "mm"), 400.0)
    assert found.step is not None
    assert_allclose(found.values, np.sin(20 * found.time), rtol=0, atol=2e-3)
    assert "made even along the monotone cubic" in found.notes[0]


@pytest.mark.parametrize(("rate", "even"), [(20.0, 20.0), (10.0, 10.0), (5.0, 10.0)])
def test_uneven_times_are_made_even_at_their_mean_rate_or_the_new_one(rate, even):
    """Eleven samples in a second have a mean rate of 10 Hz. Samples at that rate lie on the monotone cubic."""
    uneven = np.linspace(0, 1, 11) ** 1.2
    signal = Signal("road", uneven, np.sin(5 * uneven), "m")
    found, _ = resampled(signal, rate, anti_alias=False)
    exact = PchipInterpolator(uneven, signal.values)(np.arange(int(even) + 1) / even)
    assert_allclose(found.time, np.arange(int(rate) + 1) / rate, rtol=0, atol=1e-12)
    assert_allclose(found.values, exact[:: int(even / rate)], rtol=0, atol=1e-12)


def test_signals_with_rows_of_events_are_made_even_at_their_usual_step():
    """Two rows between the others, and one that is missing, in a channel that is a straight line."""
    usual = 0.3 + 0.02 * np.arange(30)
    time = np.sort(np.append(np.delete(usual, 17), [0.413, 0.5061]))
    even = even_signals(Signals(time, np.column_stack([3.0 * time, -time]), ("a", "b"), ("m", "N")))
    assert_allclose(even.time, usual, rtol=0, atol=1e-12)
    assert_allclose(even.values, np.column_stack([3.0 * usual, -usual]), rtol=0, atol=1e-9)


def test_the_report_of_uneven_times_is_that_of_even_ones():
    """Two tones below and above the new Nyquist frequency: a fifth of the mean square lay above."""
    uneven = t + 2e-5 * np.sin(np.arange(len(t)))
    values = np.sin(2 * np.pi * 40 * uneven) + 0.5 * np.sin(2 * np.pi * 300 * uneven)
    _, report = resampled(Signal("road", uneven, values, "m/s^2"), 400.0)
    assert_allclose(report.above_nyquist, 0.2, rtol=0.02, atol=0)


def test_filters_halve_the_amplitude_at_their_corner_without_shift():
    middle = slice(1000, 3000)
    for options in ({"low_pass": 40.0}, {"high_pass": 40.0}):
        found = filtered(sines(), **options)
        assert_allclose(found.values[middle], 0.5 * sines().values[middle], rtol=0, atol=2e-3)
    band = filtered(sines(high=0.5), high_pass=5.0, low_pass=150.0)
    assert_allclose(band.values[middle], sines().values[middle], rtol=0, atol=2e-3)
    assert len(band.notes) == 2


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: filtered(sines(), low_pass=1000.0), "below half the rate, 1000 Hz"),
        (lambda: filtered(Signal("a", t[:9] ** 2, t[:9], ""), low_pass=1.0), "expected equidistant times"),
        (lambda: resampled(sines(), 0.0), "expected a rate above 0"),
        (lambda: resampled(sines(), 1e12), "expected a rate above 0 that makes up to"),
        (lambda: integrated_twice(sines("mm")), r"expected an acceleration to integrate twice, got the unit 'mm'"),
        (lambda: integrated_twice(sines("counts")), r"expected an acceleration"),
        (lambda: without_drift(sines(), "men"), "did you mean 'mean'"),
        (lambda: without_drift(sines(), "high-pass"), "expected its corner frequency"),
        (lambda: without_drift(sines(), "mean", 1.0), "belongs to the drift 'high-pass'"),
    ],
)
def test_impossible_ways_are_refused(make, words):
    with pytest.raises(SignalError, match=words):
        make()


def measured():
    """A record with an offset and a slow drift, at slightly uneven times."""
    times = t + 1e-5 * np.sin(37 * t)
    return Signal("base", times, np.sin(2 * np.pi * 7 * t) + 0.05 + 0.02 * t, "m/s^2")


def test_the_note_on_drift_tells_the_largest_removed_value_and_its_share_of_the_peak():
    """A straight line from -3 to 1 has the mean -1 and the peak 3."""
    found = without_drift(Signal("base", t, np.linspace(-3.0, 1.0, len(t)), "m/s^2"), "mean")
    assert found.notes == ("drift mean: up to 1 m/s^2 removed, 33.3 % of the peak",)


def test_the_mean_is_taken_off_such_that_the_velocity_ends_as_it_began():
    motion, notes = integrated_twice(measured(), position=0.1, velocity=-0.3, drift="mean")
    end = measured().time[-1]
    assert_allclose(motion(end, 1), -0.3, rtol=1e-12, atol=0)
    assert "drift mean: up to " in notes[0]
    off = measured().values[:-1] - motion.at(measured().time[:-1], 2)
    assert np.ptp(off) < 1e-12


def test_the_baseline_is_a_straight_line_that_ends_the_motion_where_it_began():
    motion, notes = integrated_twice(measured(), drift="baseline")
    times = measured().time
    assert_allclose([motion(times[-1]), motion(times[-1], 1)], 0.0, rtol=0, atol=1e-12)
    off = measured().values[:-1] - motion.at(times[:-1], 2)
    line = np.polyval(np.polyfit(times[:-1], off, 1), times[:-1])
    assert_allclose(off, line, rtol=0, atol=1e-12)
    assert np.ptp(off) > 0.01
    assert "at its end, t = 1.99999 s, velocity" in notes[-1]


def test_a_high_pass_takes_the_slow_part_and_leaves_the_fast_one():
    steady = without_drift(Signal("base", t, np.sin(2 * np.pi * 40 * t) + 0.2 + 0.1 * t, "g"), "high-pass", 5.0)
    assert_allclose(steady.values[800:-800], np.sin(2 * np.pi * 40 * t)[800:-800], rtol=0, atol=2e-3)


def test_without_drift_the_record_is_integrated_as_it_is():
    motion, notes = integrated_twice(measured())
    exact = acceleration_table(measured().time, measured().values)
    assert_allclose(motion.pieces, exact.pieces, rtol=0, atol=0)
    assert len(notes) == 1


@pytest.mark.parametrize("corner", [2.0, 5.0, 40.0])
def test_a_low_pass_leaves_a_straight_line_up_to_its_ends(corner):
    """Odd about its ends a line goes on as one: what the filter swings in has died away over three periods."""
    line = Signal("ramp", t, 3.0 - 2.0 * t, "m")
    assert_allclose(filtered(line, low_pass=corner).values, line.values, rtol=0, atol=2e-4)


def test_a_record_of_a_part_of_a_period_of_the_corner_is_filtered():
    short = Signal("level", t[:60], np.full(60, 3.0), "m")
    assert_allclose(filtered(short, low_pass=2.0).values, 3.0, rtol=1e-9)
    assert_allclose(filtered(short, high_pass=2.0).values, 0.0, rtol=0, atol=1e-9)

"""Order tracking of run-ups whose orders are known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.errors import SignalError
from floatframe.files.signals import Signal, angle_of_speed, frequency_map, order_cut, order_map
from floatframe.files.signals.analysis import rotation_of

RATE = 2048.0
t = np.arange(int(6 * RATE)) / RATE
SPEED = 2 * np.pi * (10 + 4 * t + 0.5 * np.sin(2 * t))  # rad/s
ANGLE = 2 * np.pi * (10 * t + 2 * t**2 + 0.25 * (1 - np.cos(2 * t)))
RAMP = 0.2 * t  # an order whose amplitude rises


def run_up():
    x = 1.5 * np.sin(2 * ANGLE + 0.3) + RAMP * np.cos(4.5 * ANGLE)
    return Signal("housing", t, x, "m/s²")


def test_the_integral_of_a_speed_is_its_angle():
    assert_allclose(angle_of_speed(t, SPEED), ANGLE, rtol=0, atol=1e-9 * ANGLE[-1])


@pytest.mark.parametrize(
    ("unit", "values"),
    [
        ("rad/s", SPEED),
        ("rpm", SPEED * 30 / np.pi),
        ("Hz", SPEED / (2 * np.pi)),
        ("rad", ANGLE),
        ("deg", np.rad2deg(ANGLE)),
    ],
)
def test_a_rotation_is_given_by_its_angle_or_its_speed(unit, values):
    speed, angle = rotation_of(Signal("housing", t, t, ""), Signal("shaft", t, values, unit))
    assert_allclose(speed[1:-1], SPEED[1:-1], rtol=1e-5, atol=0)
    assert_allclose(angle, ANGLE, rtol=0, atol=1e-8 * ANGLE[-1])


@pytest.mark.parametrize("is_rms", [False, True])
def test_orders_of_a_run_up_have_their_amplitudes(is_rms):
    orders = order_map(run_up(), ANGLE, max_order=6, resolution=0.125, is_rms=is_rms)
    scale = 1 / np.sqrt(2) if is_rms else 1.0
    assert_allclose(order_cut(orders, 2.0), 1.5 * scale, rtol=2e-3, atol=0)
    assert_allclose(order_cut(orders, 4.5), 0.2 * orders.times * scale, rtol=0.02, atol=0.003)
    between = (np.abs(orders.lines - 2.0) > 0.3) & (np.abs(orders.lines - 4.5) > 0.3)
    assert np.abs(orders.amplitudes[:, between]).max() < 0.01 * scale
    assert_allclose(orders.speeds, np.interp(orders.times, t, SPEED), rtol=5e-3, atol=0)
    assert orders.unit == "m/s²"


def test_a_run_down_and_a_wheel_that_turns_backward_are_the_same():
    back = Signal("housing", t, run_up().values[::-1], "m/s²")
    orders = order_map(back, -(ANGLE[::-1] - ANGLE[-1]), max_order=6, resolution=0.125)
    assert (np.diff(orders.speeds) < 0).all()
    assert_allclose(order_cut(orders, 2.0), 1.5, rtol=2e-3, atol=0)
    assert_allclose(order_map(back, ANGLE[::-1], max_order=6, resolution=0.125).amplitudes, orders.amplitudes,
    rtol=1e-6,
                    atol=1e-9)  # fmt: skip


def test_a_fixed_frequency_is_not_mirrored_into_low_orders():
    """900 Hz is order 90 at the slowest speed and lies near half the rate: no line of it below order 20."""
    x = Signal("whine", t, np.sin(2 * np.pi * 900 * t), "m/s²")
    orders = order_map(x, ANGLE, max_order=20, resolution=0.25)
    assert np.abs(orders.amplitudes).max() < 0.02
    slowest = RATE / 10  # samples a turn at 10 turns a second
    assert int(orders.notes[-1].split()[-4]) == pytest.approx(slowest, rel=0.01), orders.notes[-1]


def test_a_wheel_that_starts_and_stops_is_seen_where_it_turns_fast():
    """Half a sine of speed: both ends are left out, and the order has its amplitude to the end of the rest."""
    fastest, end = 2 * np.pi * 12, t[-1]
    angle = fastest * end / np.pi * (1 - np.cos(np.pi * t / end))
    orders = order_map(Signal("a", t, 0.7 * np.sin(3 * angle), ""), angle, max_order=5, resolution=0.25, slowest=20.0)
    begin = end / np.pi * np.arcsin(20.0 / fastest)
    assert f"from t = {begin:.3g}" in orders.notes[0]
    assert f" to {end - begin:.4g}"[:7] in orders.notes[0]
    assert orders.times[0] - begin < 1.0 > end - begin - orders.times[-1] > 0
    assert_allclose(orders.speeds, fastest * np.sin(np.pi * orders.times / end), rtol=1e-4)
    assert_allclose(order_cut(orders, 3.0), 0.7, rtol=1e-3)


def test_by_default_speeds_below_a_twentieth_of_the_highest_are_left_out():
    angle = np.pi * 8 * t**2 / t[-1]  # from rest to 8 turns a second
    orders = order_map(Signal("a", t, np.sin(3 * angle), ""), angle, max_order=5, resolution=0.25)
    fastest = 16 * np.pi
    assert f"faster than {0.05 * fastest:.2g}" in orders.notes[0]
    begin = float(orders.notes[0].split("t = ")[1].split()[0])
    assert_allclose(begin, 0.05 * t[-1], rtol=0.01)


def test_standing_and_slow_parts_are_left_out_and_said():
    speed = np.where(t < 1.0, 0.0, 2 * np.pi * 12 * (t - 1.0))
    angle = np.where(t < 1.0, 0.0, 2 * np.pi * 6 * (t - 1.0) ** 2)
    orders = order_map(Signal("a", t, np.sin(3 * angle), ""), angle, max_order=5, resolution=0.25, slowest=20.0)
    assert orders.times[0] > 1.0 + 20 / (2 * np.pi * 12)
    assert "where the rotation is faster than 20 rad/s" in orders.notes[0]
    assert_allclose(order_cut(orders, 3.0), 1.0, rtol=5e-3, atol=0)
    assert speed.max() > 20


def test_a_rotation_that_is_never_slow_has_no_note_of_left_out_parts():
    """A steady rotation, which is used from the first sample to the last one; one slow sample at the end is said."""
    angle = 70.0 * t
    orders = order_map(Signal("a", t, np.sin(3 * angle), ""), angle, max_order=5, resolution=0.25)
    assert not any("where the rotation is faster" in note for note in orders.notes)
    slow = np.append(angle[:-2], [angle[-3]] * 2)
    orders = order_map(Signal("a", t, np.sin(3 * slow), ""), slow, max_order=5, resolution=0.25)
    assert any("where the rotation is faster" in note for note in orders.notes)


def test_a_waterfall_shows_a_line_where_it_is():
    speed = np.full(len(t), 70.0)
    found = frequency_map(Signal("a", t, 2.0 * np.sin(2 * np.pi * 64 * t), "N"), speed, n_segment=1024)
    assert_allclose(found.amplitudes[:, found.lines == 64.0], 2.0, rtol=1e-9, atol=0)
    assert_allclose(found.speeds, 70.0, rtol=1e-12, atol=0)
    raised = frequency_map(Signal("a", t, 7.0 + 2.0 * np.sin(2 * np.pi * 64 * t), "N"), n_segment=1024)
    assert_allclose(raised.amplitudes, found.amplitudes, rtol=0, atol=1e-12)  # without the mean of the record
    unasked = frequency_map(Signal("a", t, 2.0 * np.sin(2 * np.pi * 64 * t), "N"), speed)
    assert_allclose(unasked.lines[1], 16 / t[-1], rtol=2e-3)  # a sixteenth of the record, which lasts 6 s


@pytest.mark.parametrize(
    ("angle", "options", "words"),
    [
        (ANGLE[:-1], {}, "expected an angle at each"),
        (0 * ANGLE, {}, "nowhere faster than 0 rad/s"),
        (0.01 * ANGLE, {}, "turns, a block has 4"),
        (ANGLE, {"resolution": 0.0}, "0 < resolution <= 1"),
        (ANGLE, {"slowest": 1e4}, "nowhere faster than 10000"),
        (np.cumsum(np.where(t < 3, 1e-7, 1.0)), {"slowest": 1e-6}, "exclude slow speeds"),
    ],
)
def test_impossible_rotations_are_refused(angle, options, words):
    with pytest.raises(SignalError, match=words):
        order_map(run_up(), angle, **options)


def test_as_many_turns_as_a_block_has_make_one_block():
    """4 turns at 8 a second in blocks of 1/0.25 turns; a part of a sample less is refused."""
    n = int(0.5 * RATE)
    for turns, n_blocks in ((4.0, 1), (5.0, 2), (3.999, 0)):
        angle = 2 * np.pi * turns * np.arange(n + 1) / n
        x = Signal("a", t[: n + 1], np.cos(2 * angle), "")
        if not n_blocks:
            with pytest.raises(SignalError, match=r"3\.999 turns, a block has 4"):
                order_map(x, angle, max_order=5, resolution=0.25, overlap=0.75)
            continue
        orders = order_map(x, angle, max_order=5, resolution=0.25, overlap=0.75)
        assert len(orders.times) == n_blocks
        assert_allclose(order_cut(orders, 2.0), 1.0, rtol=1e-3)


@pytest.mark.parametrize("is_rms", [False, True])
@pytest.mark.parametrize("n", [64, 65])
def test_lines_of_segments_are_the_amplitudes_of_cosines_up_to_half_the_rate(n, is_rms):
    """The last line of an even number of samples is an alternation, whose amplitude is its rms value too."""
    rate, k = 50.0, np.arange(5 * n)
    x = 3 * np.cos(2 * np.pi * 8 / n * k + 0.4) + (0.7 * np.cos(np.pi * k) if n % 2 == 0 else 0.0)
    found = frequency_map(Signal("a", 2 + k / rate, x, "g"), n_segment=n, overlap=0.75, is_rms=is_rms)
    expected = np.zeros(n // 2 + 1)
    expected[8] = 3 / np.sqrt(2) if is_rms else 3.0
    expected[-1] = 0.7 if n % 2 == 0 else 0.0
    assert_allclose(found.lines, np.arange(n // 2 + 1) * rate / n, rtol=1e-14, atol=0)
    starts = np.arange(0, 4 * n + 1, round(n / 4))
    assert_allclose(found.times, 2 + (starts + (n - 1) / 2) / rate, rtol=1e-13, atol=0)
    assert found.amplitudes.shape == (len(starts), n // 2 + 1)
    lines = np.setdiff1d(np.arange(n // 2 + 1), [7, 9, n // 2 - 1])  # beside a line, hann has half of it
    for amplitudes in found.amplitudes:
        assert_allclose(amplitudes[lines], expected[lines], rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("n_t", "overlap", "starts"), [(64, 0.75, [0]), (79, 0.75, [0]), (80, 0.75, [0, 16]), (200, 0.5, range(0, 137, 32))]
)
def test_segments_of_a_waterfall_fill_the_record(n_t, overlap, starts):
    time = 3.0 + np.arange(n_t) / 128
    speed = np.arange(n_t, dtype=float)
    found = frequency_map(Signal("a", time, np.sin(time), ""), speed, n_segment=64, overlap=overlap)
    assert_allclose(found.times, [3.0 + (k + 31.5) / 128 for k in starts], rtol=1e-12)
    assert_allclose(found.speeds, [k + 31.5 for k in starts], rtol=1e-12)

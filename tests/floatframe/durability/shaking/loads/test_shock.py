"""Shocks: pulses, what they leave, histories made for spectra, and runs against pyYeti."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.durability.shaking.loads.levels import Level
from floatframe.durability.shaking.loads.pulses import damped_sines, pulse, synthesised
from floatframe.durability.shaking.loads.shock import SpectrumRequest, TimeTest, sampled, time_runs
from floatframe.durability.shaking.loads.uncertainty import Uncertainty
from floatframe.durability.shaking.responses.response_spectrum import shock_response_spectrum
from floatframe.errors import ModelError
from tests.floatframe.durability.shaking.single_mass import ACCELERATION, DISPLACEMENT, masses

G = 9.80665


@pytest.mark.parametrize(
    ("kind", "share"),
    [("half-sine", 2 / np.pi), ("terminal-peak", 0.5), ("initial-peak", 0.5), ("triangle", 0.5), ("trapezoid", 0.9)],
)
def test_a_pulse_leaves_its_velocity_change(kind, share):
    t, a = pulse(kind, 40.0, 0.011)
    run = time_runs(masses([80.0], 0.05), TimeTest("s", t, a, ("z",), kind="shock"))[0]
    assert_allclose(run.velocity_left, [40.0 * 0.011 * share], rtol=1e-5)
    assert run.t[-1] > 0.011 + 9.9 / 80.0


def test_outputs_are_those_of_pyyeti_on_the_same_samples():
    from pyyeti.ode import SolveUnc

    model = masses([80.0, 95.0], 0.03, [1.0, 0.6])
    t, a = pulse("half-sine", 40.0, 0.011)
    run = time_runs(model, TimeTest("s", t, a, ("z",), kind="shock"))[0]
    assert not run.notes
    h = float(run.t[1])
    solver = SolveUnc(np.ones(2), np.diag(model.C), model.omega**2, h)
    motion = solver.tsolve(np.outer(model.B[2, :, 2], run.input_values[0]))
    expected = model.E[0] @ motion.d + model.E[2] @ motion.a + np.outer(model.D[2, :, 2], run.input_values[0])
    assert_allclose(run.values, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    spectrum = run.spectra["mass acceleration z"][10.0]
    assert_allclose(
        spectrum, shock_response_spectrum(run.values[ACCELERATION], h, run.spectra_frequencies, 10.0), rtol=1e-12
    )


def test_histories_meet_the_closed_form_of_a_step():
    model = masses([5.0], 0.0)
    t = np.array([0.0, 0.35])
    run = time_runs(model, TimeTest("s", t, np.array([2.0, 2.0]), ("z",), after=0.0))[0]
    omega = 2 * np.pi * 5
    assert_allclose(run.values[DISPLACEMENT], -2.0 / omega**2 * (1 - np.cos(omega * run.t)), rtol=0, atol=1e-12)


def test_unequal_times_are_told():
    run = time_runs(
        masses([5.0], 0.01), TimeTest("s", np.array([0, 0.1, 0.1 + np.pi / 30]), np.array([0, 1.0, 0]), ("z",))
    )[0]
    assert any("unequal times were resampled" in note for note in run.notes)


@pytest.mark.parametrize("f", [30.0, 80.0, 150.0], ids=["rising", "near the top", "falling"])
def test_uncertain_frequencies_give_the_largest_of_three_runs(f):
    """Where the spectrum of the pulse rises the stiffer structure has the largest answer, where it falls the softer."""
    t, a = pulse("half-sine", 40.0, 0.011)
    test = TimeTest("s", t, a, ("z",), kind="shock")
    runs = [time_runs(masses([scale * f], 0.02), test)[0].peaks for scale in (0.9, 1.0, 1.1)]
    own = time_runs(masses([f], 0.02), test, Uncertainty(1.25, 0.1))[0]
    assert_allclose(own.uncertain, 1.25 * np.max(runs, axis=0), rtol=2e-3)


@pytest.mark.parametrize(("modes", "first", "last"), [([40.0, 300.0], 4.0, 600.0), ([900.0, 7000.0], 10.0, 1e4)])
def test_spectra_of_responses_reach_from_below_the_first_mode_to_above_the_last(modes, first, last):
    t, a = pulse("half-sine", 40.0, 0.002)
    test = TimeTest("s", t, a, ("z",), kind="shock", spectra=SpectrumRequest(Q=(10.0,)))
    run = time_runs(masses(modes, 0.02), test)[0]
    assert_allclose(run.spectra_frequencies[[0, -1]], [first, last], rtol=0.06)


def test_a_history_for_a_spectrum_meets_it_and_leaves_nothing():
    target = Level.of([(100, 50.0), (1000, 1000.0), (2000, 1000.0)])
    made = synthesised(target, 10.0)
    assert np.abs(made.decibels).max() < 1.0
    from pyyeti import srs

    other = srs.srs(
        made.acceleration, 1 / made.time[1], made.frequencies, 10.0, rolloff="none", time="total", parallel="no"
    )
    below = made.frequencies < 900  # both look at 20 samples a cycle and more there
    assert_allclose(made.reached[below], other[below], rtol=1.5e-2)
    run = time_runs(masses([300.0], 0.05), TimeTest("p", made.time, made.acceleration * G, ("z",), kind="shock"))[0]
    largest = np.abs(np.cumsum(made.acceleration)).max() * made.time[1] * G
    assert abs(run.velocity_left[0]) < 1e-3 * largest
    again = shock_response_spectrum(made.acceleration, made.time[1], made.frequencies, 10.0)
    assert_allclose(again, made.reached, rtol=1e-12)


@pytest.mark.parametrize(
    ("rows", "decay"), [([(100, 50), (1000, 1000), (4000, 1000)], 0.05), ([(20, 5), (200, 100), (500, 100)], 0.03)]
)
def test_damped_sines_meet_a_spectrum_and_leave_neither_velocity_nor_displacement(rows, decay):
    from pyyeti import srs

    target = Level.of(rows)
    made = damped_sines(target, 10.0, decay=decay)
    assert np.abs(made.decibels).max() < 0.75
    t, a = made.time, made.acceleration
    fine = np.linspace(0, t[-1], 4 * (len(t) - 1) + 1)  # straight between the samples, for a second program
    f = np.geomspace(target.first, target.last, 25)
    other = srs.srs(np.interp(fine, t, a), 1 / fine[1], f, 10.0, rolloff="none", time="total", parallel="no")
    assert np.abs(20 * np.log10(other / target.at(f))).max() < 1.0
    h = t[1]
    v = np.concatenate([[0], np.cumsum(h * (a[1:] + a[:-1]) / 2)])
    x = np.concatenate([[0], np.cumsum(h * v[:-1] + h**2 * (a[:-1] / 3 + a[1:] / 6))])
    assert abs(v[-1]) < 1e-10 * np.abs(v).max()
    assert abs(x[-1]) < 1e-9 * np.abs(x).max()
    assert abs(a[-1]) < 1e-12 * np.abs(a).max()
    rise = np.abs(a).argmax()
    assert rise < 0.2 * len(a)  # it rings down
    run = time_runs(masses([300.0], 0.05), TimeTest("p", t, a * G, ("z",), kind="shock"))[0]
    assert abs(run.displacement_left[0]) < 1e-6 * np.abs(x).max() * G


def steps_of(made, target, duration):
    """Check the times of a history: 20 in a cycle of the highest frequency, and just enough for the duration."""
    h = 1 / (20 * target.last)
    assert_allclose(np.diff(made.time), h, rtol=1e-9)
    assert duration <= made.time[-1] < duration + h
    octaves = np.log2(target.last / target.first)
    return made.time, np.geomspace(target.first, target.last, int(np.ceil(6 * octaves)) + 1)


def require_sum(acceleration, waves):
    """Check that a history is a sum of shapes whose amplitudes alternate in sign, the first one positive."""
    amplitudes, *_ = np.linalg.lstsq(waves.T, acceleration, rcond=None)
    assert_allclose(amplitudes @ waves, acceleration, rtol=0, atol=1e-9 * np.abs(acceleration).max())
    assert np.all(amplitudes * (-1.0) ** np.arange(len(waves)) > 0)


@pytest.mark.parametrize("duration", [None, 0.011])
def test_a_history_for_a_spectrum_is_the_sum_of_wavelets_of_its_docstring(duration):
    """Wavelets of an odd number of half-cycles, as many as fit into the duration, but at most 31."""
    target = Level.of([(190, 20.0), (700, 300.0), (3000, 250.0)])
    made = synthesised(target, 15.0, duration)
    length = 5 / 190 if duration is None else duration
    t, f = steps_of(made, target, length)
    waves = np.zeros((len(f), len(t)))
    for k, own in enumerate(f):
        n = max(odd for odd in range(3, 33, 2) if odd == 3 or odd / (2 * own) <= length)
        inside = t <= n / (2 * own)
        waves[k, inside] = (np.sin(2 * np.pi * own * t) * np.sin(2 * np.pi * own * t / n))[inside]
    require_sum(made.acceleration, waves)
    assert_allclose(made.target, target.at(made.frequencies), rtol=1e-12)
    assert_allclose(made.frequencies, np.geomspace(190, 3000, 2 * len(f) - 1), rtol=1e-12)


@pytest.mark.parametrize("duration", [None, 0.13])
def test_a_history_of_damped_sines_is_their_sum_less_what_they_leave(duration):
    target, decay = Level.of([(40, 5.0), (300, 100.0), (700, 100.0)]), 0.04
    made = damped_sines(target, 10.0, duration, decay=decay)
    t, f = steps_of(made, target, np.log(1000) / (2 * np.pi * decay * 40) if duration is None else duration)
    fade = np.where(t > 0.95 * t[-1], 0.5 + 0.5 * np.cos(np.pi * (t / t[-1] - 0.95) / 0.05), 1.0)

    def ringing(frequency, zeta):
        omega = 2 * np.pi * frequency
        return np.exp(-zeta * omega * t) * np.sin(omega * t) * fade

    def left(a):
        velocity = np.concatenate([[0], np.cumsum((a[1:] + a[:-1]) / 2)])
        return np.array([velocity[-1], (velocity[:-1] + a[:-1] / 3 + a[1:] / 6).sum()])

    slow = np.array([ringing(20.0, 0.8), ringing(10.0, 0.8)])
    cure = np.linalg.inv(np.column_stack([left(each) for each in slow]))
    waves = np.array([ringing(own, decay) for own in f])
    require_sum(made.acceleration, np.array([wave - (cure @ left(wave)) @ slow for wave in waves]))


def test_damped_sines_of_no_use_are_refused():
    target = Level.of([(10, 1.0), (100, 10.0)])
    with pytest.raises(ModelError, match=r"less than three cycles of the first frequency, 10 Hz; expected 0\.3 s"):
        damped_sines(target, 10.0, 0.1)
    with pytest.raises(ModelError, match=r"decay: expected a ratio from 0\.005 to 0\.5, got 2"):
        damped_sines(target, 10.0, decay=2.0)
    with pytest.raises(ModelError, match="too many; take a shorter duration"):
        damped_sines(Level.of([(0.001, 1.0), (10000, 10.0)]))


def test_a_time_too_short_for_a_spectrum_is_refused():
    with pytest.raises(ModelError, match="less than three half-cycles"):
        synthesised(Level.of([(10, 1.0), (100, 10.0)]), 10.0, 0.1)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"time": [0, 1, 1], "history": [0, 1, 0]}, "row 3: 1 s after 1 s"),
        ({"time": [0, 1, 2], "history": [0, 1]}, "expected 3 values"),
        ({"time": [0, 1, 2], "history": [0, np.nan, 1]}, "row 2: expected a finite number"),
        ({"time": [0, 1, 2]}, "either a history"),
        ({"time": [0], "history": [0]}, "two finite times"),
    ],
)
def test_histories_that_make_no_sense_are_refused(given, words):
    with pytest.raises(ModelError, match=words):
        TimeTest("s", np.array(given["time"]), None if "history" not in given else np.array(given["history"]))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (("sine", 1, 1), "expected one of"),
        (("triangle", 1, 0), "seconds above 0"),
        (("triangle", 0, 1), "other than 0"),
    ],
)
def test_pulses_that_make_no_sense_are_refused(given, words):
    with pytest.raises(ModelError, match=words):
        pulse(*given)


def test_too_many_samples_are_refused_with_the_remedy():
    model = masses([1.0, 1e6], 0.01)
    with pytest.raises(ModelError, match="residual_above"):
        time_runs(model, TimeTest("s", np.array([0, 1.0]), np.array([0, 1.0]), ("z",)))
    run = time_runs(
        replace(model, n_residual=1),
        TimeTest("s", np.array([0, 1.0]), np.array([0, 1.0]), ("z",), spectra=SpectrumRequest(first=1, last=5)),
    )
    assert len(run[0].t) < 1000


@pytest.mark.parametrize(
    ("units", "acceleration", "turning", "force", "moment"),
    [
        ("m-kg-s", 1.0, 1.0, 1.0, 1.0),
        ("mm-t-s", 1e3, 1.0, 1.0, 1e3),
        ("mm-kg-ms", 1e-3, 1e-6, 1e-3, 1.0),  # mm/ms², rad/ms², kN, kN mm
        ("mm-g-ms", 1e-3, 1e-6, 1.0, 1e3),
        ("in-slinch-s", 1 / 0.0254, 1.0, 1 / 4.4482216152605, 1 / 4.4482216152605 / 0.0254),  # in/s², lbf, lbf in
    ],
)
def test_inputs_in_si_become_units_of_the_model(units, acceleration, turning, force, moment):
    model = masses([80.0], 0.05, units=units)
    more = replace(
        model,
        inputs=(*model.inputs, "tip:x", "tip:rx", "load case a"),
        rates=np.array([2] * 6 + [0] * 3),
        B=np.concatenate([model.B, np.zeros((3, 1, 3))], axis=2),
        D=np.concatenate([model.D, np.zeros((3, 3, 3))], axis=2),
    )
    t, a = pulse("half-sine", 40.0, 0.011)
    names = ("base:z", "base:ry", "tip:x", "tip:rx", "load case a")
    run = time_runs(more, TimeTest("s", t, inputs=dict.fromkeys(names, a)))[0]
    found = dict(zip(run.inputs, np.abs(run.input_values).max(axis=1) / 40.0, strict=True))
    for name, factor in zip(names, (acceleration, turning, force, moment, 1.0), strict=True):
        assert_allclose(found[name], factor, rtol=1e-9, err_msg=name)


def test_rounded_times_are_the_equal_steps_that_they_were():
    """51.2 kHz written with six digits: what rings at 4 kHz and lasts one sample is not folded down, nor lost."""
    exact = np.arange(4096) / 51200.0
    a = 1e3 * np.sin(2 * np.pi * 4000.3 * exact) * np.exp(-exact / 0.02)
    a[700] += 5e4
    model = masses([35.0, 300.0], 0.02)
    own, rounded = (
        time_runs(model, TimeTest("s", t, a, ("z",), kind="shock"))[0] for t in (exact, np.round(exact, 6) + 3.0)
    )
    assert "taken as equal steps" in rounded.notes[0]
    assert not own.notes
    assert_allclose(rounded.peaks, own.peaks, rtol=1e-4)
    assert_allclose(rounded.velocity_left, own.velocity_left, rtol=1e-4)
    for name, spectra in own.spectra.items():
        assert_allclose(rounded.spectra[name][10.0], spectra[10.0], rtol=1e-3)


def test_unequal_times_keep_areas_and_what_is_fast():
    """Displacement of an oscillator under straight pieces, by its Green's function and their integrals."""
    rng = np.random.default_rng(2)
    t = np.concatenate([[0.0], np.cumsum(10 ** rng.uniform(-5.0, -3.0, size=400))])
    a = rng.normal(size=len(t))
    a[0] = a[-1] = 0.0
    a[200] = 300.0  # a spike that no step of 20 points a cycle would see
    f, zeta = 25.0, 0.03
    run = time_runs(masses([f], zeta), TimeTest("s", t, a, ("z",), after=0.02))[0]
    omega = 2 * np.pi * f
    damped = omega * np.sqrt(1 - zeta**2)
    x, w = np.polynomial.legendre.leggauss(4)
    tau = ((t[:-1] + t[1:]) / 2)[:, None] + np.diff(t)[:, None] / 2 * x
    area = np.diff(t)[:, None] / 2 * w * np.interp(tau, t, a)
    for k in (len(run.t) // 3, len(run.t) // 2, len(run.t) - 1):
        lag = run.t[k] - tau
        green = np.where(lag > 0, np.exp(-zeta * omega * lag) * np.sin(damped * lag) / damped, 0.0)
        assert_allclose(run.values[DISPLACEMENT, k], -(area * green).sum(), rtol=2e-3)
    assert_allclose(run.velocity_left, [np.trapezoid(a, t)], rtol=1e-9)
    assert any("areas under the linear pieces are preserved" in note for note in run.notes)


def test_a_history_in_equal_steps_keeps_its_last_sample():
    t = np.linspace(0.0, 1.0, 11)
    times, values, _ = sampled(t, 1.0 + t[None], 0.03, 0.0)
    assert_allclose(times[-1], 1.0, rtol=1e-12)
    assert_allclose(values[0], 1.0 + times, rtol=1e-12)

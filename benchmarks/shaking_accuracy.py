"""How exact base shaking is, the figures of docs/shake.md: python -m benchmarks.shaking_accuracy."""

import numpy as np
from pyyeti import ode, srs

from floatframe.durability.shaking.loads.levels import Level
from floatframe.durability.shaking.loads.pulses import damped_sines, pulse, synthesised
from floatframe.durability.shaking.loads.random_vibration import RandomTest, random_runs
from floatframe.durability.shaking.loads.sine import SineTest, sweep_envelope
from floatframe.durability.shaking.responses.response_spectrum import octave_frequencies, shock_response_spectrum
from floatframe.durability.shaking.responses.time_steps import oscillator
from tests.floatframe.durability.shaking.single_mass import ACCELERATION, masses

G = 9.80665


def main() -> None:
    """Print each figure on a line."""
    for Q in (10.0, 100.0, 1000.0):
        white = Level.of([(1e-3, 0.04), (1e7, 0.04)], "g2/Hz")
        run = random_runs(masses([50.0], 1 / (2 * Q)), RandomTest("r", white, ("z",)))[0]
        exact = G * np.sqrt(0.04 * (np.pi / 2 * 50.0 * Q * (1 + 1 / Q**2) - 1e-3))  # less what is below 1 mHz
        error = abs(run.rms[ACCELERATION] / exact - 1)
        bound = run.error[ACCELERATION]
        print(f"rms under white noise, Q = {Q:g}: {error:.1e} from the closed form, bound {bound:.1e}")
    level = Level.of([(20, 0.01), (80, 0.04), (350, 0.04), (2000, 0.007)], "g2/Hz")
    model = masses([45.0, 47.0, 300.0], [0.02, 0.01, 0.03], [1.0, 0.4, 0.7])
    run = random_runs(model, RandomTest("r", level, ("z",)))[0]
    solver = ode.SolveUnc(np.ones(3), np.diag(model.C), model.omega**2)
    rows = [[model.E[2], None, model.E[0], model.D[2][:, [2]]]]
    f = run.band.frequencies
    _, psd = ode.solvepsd(solver, (level.at(f) * G**2)[None], model.B[2][:, [2]], f, rows)
    print(f"densities beside pyYeti's: {np.abs(run.density / np.asarray(psd[0]).T - 1).max():.1e}")
    load = np.random.default_rng(0).normal(size=5000)
    own = oscillator(31.0, 0.02, load, 0.01)
    other = ode.SolveUnc(np.ones(1), np.array([2 * 0.02 * 31.0]), np.array([31.0**2]), 0.01).tsolve(load[None])
    print(f"history of a mass beside pyYeti's: {np.abs(own.second - other.a[0]).max() / np.abs(other.a[0]).max():.1e}")
    t, a = pulse("half-sine", 50.0, 0.011)
    f = octave_frequencies(20, 900, 12)
    a = np.pad(a, (0, 4000))
    mine = shock_response_spectrum(a, t[1], f, 10.0)
    theirs = srs.srs(a, 1 / t[1], f, 10.0, rolloff="none", time="total", parallel="no")
    print(
        f"spectrum of a half-sine beside pyYeti's, 41 samples a cycle and more: {np.abs(mine / theirs - 1).max():.1e}"
    )
    for rate in (2.0, 30.0):
        test = SineTest("s", Level.of([(5, 1.0), (100, 1.0)]), ("z",), rate)
        peaks = [np.abs(sweep_envelope(model, 2, test, step)[1][:, ACCELERATION]).max() for step in (0.05, 0.005)]
        off = abs(peaks[0] / peaks[1] - 1)
        print(f"peak of a sweep at {rate:g} octaves a minute: {off:.1e} from ten times finer steps")
    made = synthesised(Level.of([(100, 50), (1000, 1000), (4000, 1000)]))
    print(f"history for a spectrum: {made.decibels.min():+.2f} to {made.decibels.max():+.2f} dB from its target")
    made = damped_sines(Level.of([(100, 50), (1000, 1000), (4000, 1000)]))
    print(f"the same of damped sines: {made.decibels.min():+.2f} to {made.decibels.max():+.2f} dB from its target")


if __name__ == "__main__":
    main()

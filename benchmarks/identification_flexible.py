"""A flexible arm with simulated noise: stiffness, damping and frequency of its link, identified with its inertia.

python -m benchmarks.identification_flexible [number of noises, 200]

A motor swings the arm in a vertical plane; its torque, the deflection of the tip and forces at the base have noise.
Deviations predicted and found of hub, payload, link and friction, and of the first frequency of the link.
"""

import logging
import sys

import numpy as np

import floatframe as ff
from tests.floatframe.design.identification.flexible_arm import NOISE, OUTPUTS, TRUTH, arm, link

T_END, DISTANCE, STEP = 2.0, 0.01, 0.0025
SETS = {
    "torque": OUTPUTS[:1],
    "torque and tip": OUTPUTS[:2],
    "torque and base": (OUTPUTS[0], *OUTPUTS[2:]),
    "all": OUTPUTS,
}


def frequency(p: dict[str, float]) -> float:
    """The first frequency of the link, clamped at its root [Hz]: by the factors of stiffness and mass."""
    return float(link().frequencies[0] * np.sqrt(p["stiffness"] / p["mass"]))


def main() -> None:
    """Print a table for each set of outputs."""
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    logging.disable(logging.WARNING)
    t = np.arange(round(T_END / DISTANCE) + 1) * DISTANCE
    exact = ff.design.identification.computed_outputs(arm(TRUTH), t, OUTPUTS, h=STEP).table
    truth = np.array([*TRUTH.values(), frequency(TRUTH)])
    for title, outputs in SETS.items():
        pick = [OUTPUTS.index(name) for name in outputs]
        rng = np.random.default_rng(1)
        first = None
        found, predicted = [], []
        for _ in range(n):
            noisy = exact[:, pick] + NOISE[pick] * rng.normal(size=(len(t), len(pick)))
            data = ff.design.identification.MeasuredOutputs(t, dict(zip(outputs, noisy.T, strict=True)))
            made = ff.design.identification.fit_outputs(arm, TRUTH, data, h=STEP, near=first)
            first = first or made
            f, deviation = made.derived(frequency)
            found.append([*made.values, f])
            predicted.append([*made.deviations, deviation])
        error, deviation = np.array(found) - truth, np.mean(predicted, axis=0)
        print(f"\n{title}: {len(t)} rows, {n} noises, largest correlation "
              f"{np.abs(np.triu(made.correlations, 1)).max():.2f}")  # fmt: skip
        print(f"{'':12}{'truth':>10}{'deviation':>12}{'relative':>10}{'bias/se':>9}{'found/predicted':>17}")
        for k, name in enumerate([*TRUTH, "frequency"]):
            bias = error[:, k].mean() / deviation[k] * np.sqrt(n)
            print(f"{name:12}{truth[k]:10.4g}{deviation[k]:12.2g}{deviation[k] / truth[k]:10.2%}{bias:9.2f}"
                  f"{error[:, k].std() / deviation[k]:17.3f}")  # fmt: skip


if __name__ == "__main__":
    main()

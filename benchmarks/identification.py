"""A robot of six axes with simulated noise: what torques, reactions at the base, and both together tell.

python -m benchmarks.identification [number of noises, 200]

An exciting motion within limits; the same motion with many noises, each estimated; deviations predicted and found.
"""

import sys

import numpy as np

import floatframe as ff
from tests.floatframe.design.identification.robots import KUKA_LIKE, six_axes

TORQUE_NOISE = np.array([8.0, 12.0, 6.0, 2.0, 1.5, 1.0])  #: [N m]
BASE_NOISE = np.array([20.0, 20.0, 30.0, 15.0, 15.0, 10.0])  #: [N, N m]
PERIOD, ROWS = 10.0, 200


def main() -> None:
    """Print a table."""
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    form = ff.design.identification.linear_form(six_axes(**KUKA_LIKE, seed=4), ("viscous", "coulomb"))
    phi = form.values
    phi[60:66], phi[66:] = 5.0, 3.0
    names = [f"joint{k + 1}/angle" for k in range(6)]
    limits = dict.fromkeys(names, ff.design.identification.MotionLimits(-2.5, 2.5, 3.0, 12.0))
    base = ff.design.identification.base_parameters(form)
    options = {"period": PERIOD, "n_harmonics": 5, "n_instants": 40}
    plain = ff.design.identification.exciting_motion(base, limits, **options, max_iterations=0)
    motion = ff.design.identification.exciting_motion(base, limits, **options, max_iterations=15)
    samples = ff.design.identification.tree_samples(form.system, *motion.at(np.arange(ROWS) * PERIOD / ROWS))
    print(f"base parameters with friction: torques {len(base.kept)}")
    tau, wrench = form.torques(samples) @ phi, form.reactions(samples) @ phi
    print(f"condition number: best of random motions {plain.condition:.1f}, improved {motion.condition:.1f}")
    heads = (("known", 7), ("bias/se, largest", 18), ("found/predicted", 17), ("median dev.", 13), ("doubtful", 13))
    print("measured".ljust(12) + "".join(word.rjust(width) for word, width in heads))
    shared = {}
    for source in ("torques", "reactions", "both"):
        own = ff.design.identification.base_parameters(form, source=source)
        rng = np.random.default_rng(1)
        found, predicted = [], []
        for _ in range(n):
            noisy = tau + TORQUE_NOISE * rng.normal(size=tau.shape), wrench + BASE_NOISE * rng.normal(size=wrench.shape)
            data = ff.design.identification.Measured(
                samples, None if source == "reactions" else noisy[0], None if source == "torques" else noisy[1]
            )
            made = ff.design.identification.estimate(form, data, base=own)
            found.append(made.values)
            predicted.append(made.deviations)
        error, deviation = np.array(found) - own.values(phi), np.mean(predicted, axis=0)
        bias = np.abs(error.mean(axis=0) / deviation).max() * np.sqrt(n)
        ratio = np.sqrt(((error.std(axis=0) / deviation) ** 2).mean())
        relative = deviation / np.maximum(np.abs(own.values(phi)), 1e-9)
        print(
            f"{source:12}{len(own.kept):7d}{bias:18.2f}{ratio:17.3f}{np.median(relative):13.2%}"
            f"{(relative > 0.3).sum():6d} > 30 %"
        )
        lead = base.B[:, own.kept]
        if np.allclose(lead @ own.B, base.B, atol=1e-7):
            shared[source] = np.sqrt(np.diag(lead @ made.covariance @ lead.T))
    fall = shared["both"] / shared["torques"]
    print(f"deviations of the {len(fall)} of torques, both over torques alone: median {np.median(fall):.2f}, "
          f"least {fall.min():.2f}, largest {fall.max():.2f}")  # fmt: skip


if __name__ == "__main__":
    main()

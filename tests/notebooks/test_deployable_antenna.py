"""The notebook deployable_antenna runs, and its claims hold."""

from tests.notebooks.running import run

#: what holds after the statements that begin so
CLAIMS = {
    'print({name: f"{value:.1e}" for name, value in deviation.ite': [
        "assert max(deviation.values()) < 0.03",
    ],
    'print(f"spacecraft: {1e3 * bus.r[after, 2].mean():.4f} mm on': [
        "assert abs(bus.r[after, 2].mean() / moved - 1) < 0.05",
        'assert np.abs(motion.linear_momentum).max() < 1e-6 * abs(latched["impulse"]["latch"])',
    ],
    'axes[1].set(xlabel="t after the latch [s]", ylabel="pin off': [
        ('assert seen["eccentricity"].max() < 1.5e-4 and (seen["contacts"][motion.t > event["t"]] == 0).any()'),
    ],
}


def test_the_notebook_runs_and_its_claims_hold():
    run("deployable_antenna", CLAIMS)

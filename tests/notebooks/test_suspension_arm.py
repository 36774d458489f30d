"""The notebook suspension_arm runs, and its claims hold."""

from tests.notebooks.running import run

#: what holds after the statements that begin so
CLAIMS = {
    'print(f"{1e3 * body.moments.m:.4f} kg, by the volume of the': [
        "assert abs(body.moments.m / mass - 1) < 1e-4",
    ],
    'print(road["front left"].unit, f"{np.ptp(steady):.0f} mm fro': [
        "assert abs(ratio - 1) < 0.05",
    ],
    'print(f"out of balance at the ball joint: {np.abs(left).max(': [
        "assert np.abs(here - there).max() < 1e-3 * np.abs(there).max()",
        "assert np.abs(left).max() < 1e-3 * np.linalg.norm(load[held[:3]])",
    ],
    "by_push = response[:, 0, 0] / (1 - response[:, 1, 0])": [
        "assert np.median(np.abs(by_road / by_push - 1)) < 1e-3",
    ],
    "in_band = np.interp(f[band], H1.frequencies, np.arange(len(H": [
        ("assert np.allclose(H1.frequencies[in_band], f[band]) and H1.coherence[in_band].min() > 0.9"),
    ],
    'print(f"{band.sum()} lines from 0.5 to 15 Hz: H1 is off the': [
        "assert np.median(apart) < 0.015 and np.quantile(apart, 0.95) < 0.04",
    ],
    'print(f"damage {damage:.6e}, of floatframe fatigue {result.d': [
        "assert abs(damage / result.damage[worst] - 1) < 1e-6",
    ],
    "print(f\"Dirlik over their mean: {found['dirlik'] / mean:.2f}": [
        'assert abs(found["dirlik"] - mean) < 3 * error',
    ],
}


def test_the_notebook_runs_and_its_claims_hold():
    run("suspension_arm", CLAIMS)

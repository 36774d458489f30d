"""The notebook landing_gear runs, and its claims hold."""

from tests.notebooks.running import run

#: what holds after the statements that begin so
CLAIMS = {
    'print("heights after 0.25 s, floatframe and SciPy [m]:", np.': [
        "assert np.allclose(found, exact.y[:2, -1], rtol=1e-4)",
    ],
    'print(f"moment of momentum {1.5 * spin[-1]:.2f} N m s, impul': [
        "assert np.isclose(1.5 * spin[-1], gained[-1], rtol=3e-3)",
    ],
    "print(f\"jack {np.abs(jack['stroke jack'] + 0.4 - circles.jac": [
        'assert np.allclose(jack["stroke jack"] + 0.4, circles.jack, rtol=0, atol=1e-9)',
    ],
}


def test_the_notebook_runs_and_its_claims_hold():
    run("landing_gear", CLAIMS)

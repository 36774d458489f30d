"""The notebook slender_beams runs, and its claims hold."""

from tests.notebooks.running import run

#: what holds after the statements that begin so
CLAIMS = {
    "largest = np.abs(reference.deflection).max()": [
        ('assert np.abs(found["assumed modes, stiffened"].deflection - reference.deflection).max() < 0.03 * largest'),
    ],
}


def test_the_notebook_runs_and_its_claims_hold():
    run("slender_beams", CLAIMS)

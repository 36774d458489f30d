"""The notebook mode_families runs, and its claims hold."""

from tests.notebooks.running import run

#: what holds after the statements that begin so
CLAIMS = {
    "Q_A, Q_B = basis(A), basis(B)": [
        "assert Q_A.shape == Q_B.shape",
    ],
}


def test_the_notebook_runs_and_its_claims_hold():
    run("mode_families", CLAIMS)

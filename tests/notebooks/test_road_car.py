"""The notebook road_car runs, and its claims hold."""

from tests.notebooks.running import run

#: what holds after the statements that begin so
CLAIMS = {
    "stiffness[support, mode] = 1e3 * row[-2]": [
        "assert np.isclose(row[-2], row[-1], rtol=1e-3)",
    ],
}


def test_the_notebook_runs_and_its_claims_hold():
    run("road_car", CLAIMS)

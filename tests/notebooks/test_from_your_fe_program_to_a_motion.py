"""The notebook from_your_fe_program_to_a_motion runs, and its claims hold."""

from tests.notebooks.running import run

#: what holds after the statements that begin so
CLAIMS = {
    "right.grid(alpha=0.3)": [
        'assert apart.max() < 1e-6 * np.abs(deflection["Exudyn"]).max()',
    ],
    "away = np.abs(tip_path(again, back) - tip_path(soft, lever))": [
        "assert away < 1e-6 * length",
    ],
}


def test_the_notebook_runs_and_its_claims_hold():
    run("from_your_fe_program_to_a_motion", CLAIMS)

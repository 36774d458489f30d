"""The notebook railway_engine runs, and its claims hold."""

from tests.notebooks.running import run

#: what holds after the statements that begin so
CLAIMS = {
    'print(f"{study.n_dof} dofs; imbalance", {case: f"{full.imbal': [
        "assert all(full.imbalance < 1e-9 for full in study.full.values())",
    ],
    "energy = {(r.loading, r.mode_set, r.n_modes): r.largest[1] f": [
        ('assert energy["s_curve", "craig-bampton-ir", 0] < 0.1 * energy["s_curve", "craig-bampton", 20]'),
        (
            'assert energy["defect", "rubin", 20] < 0.5 * energy["defect", "craig-bampton-ir", 20] < '
            '0.5 * energy["defect", "craig-bampton", 20]'
        ),
    ],
}


def test_the_notebook_runs_and_its_claims_hold():
    run("railway_engine", CLAIMS)

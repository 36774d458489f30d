"""The notebook where_linear_frames_fail runs, and its claims hold."""

from tests.notebooks.running import run

#: what holds after the statements that begin so
CLAIMS = {
    'print(f"{name}: {steady:.3f} mm")': [
        "assert abs(steady - 0.514) < 0.005",
    ],
    'print(f"largest error of the first flapping frequency up to': [
        "assert error < 0.01",
    ],
    'print(f"largest error of the first whirl up to {Omega[-1] /': [
        "assert error < 1e-3",
    ],
}


def test_the_notebook_runs_and_its_claims_hold():
    run("where_linear_frames_fail", CLAIMS)

"""The notebook motor_bogie runs, and its claims hold."""

from tests.notebooks.running import run

#: what holds after the statements that begin so
CLAIMS = {
    'print(f"{name}: {line:.1f} in the motion, {said:.1f} by phas': [
        "assert abs(line / said - 1) < 0.03",
    ],
}


def test_the_notebook_runs_and_its_claims_hold():
    run("motor_bogie", CLAIMS)

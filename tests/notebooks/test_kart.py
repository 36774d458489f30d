"""The notebook kart runs, and its claims hold."""

from tests.notebooks.running import run

#: what holds after the statements that begin so
CLAIMS = {
    'for label, name in (("flexible", "kart.toml"), ("rigid", "ka': [
        'assert turns["flexible"].radius > turns["rigid"].radius',
    ],
}


def test_the_notebook_runs_and_its_claims_hold():
    run("kart", CLAIMS)

"""The notebook controlled_arm runs, and its claims hold."""

from tests.notebooks.running import run


def test_the_notebook_runs():
    run("controlled_arm")

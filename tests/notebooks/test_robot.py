"""The notebook robot runs, and its claims hold."""

from tests.notebooks.running import run


def test_the_notebook_runs():
    run("robot")

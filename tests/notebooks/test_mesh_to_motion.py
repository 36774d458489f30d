"""The notebook mesh_to_motion runs, and its claims hold."""

from tests.notebooks.running import run


def test_the_notebook_runs():
    run("mesh_to_motion")

"""The notebook vehicle_manoeuvres runs, and its claims hold."""

from tests.notebooks.running import run


def test_the_notebook_runs():
    run("vehicle_manoeuvres")

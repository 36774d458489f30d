"""Tests of the engine in the coordinates of joints: `pytest --formulation relative` runs those of these rooms again.

What is not given a formulation takes "relative" then: motions by generalized-alpha and its cases, equilibria, small
motions, driven motions. Schemes that are absolute alone stay as they are, and so does what a test asks for by name.
"""

import functools
from pathlib import Path

import pytest

from tests.root import ROOT

#: rooms of tests/floatframe that run a system as a whole
ROOMS = (
    "aerodynamics", "analyses", "bodies", "cables", "clearances", "compiling", "drives", "elements", "flexible_parts",
    "forces", "friction", "hydraulics", "integrators", "joints", "machines", "mechanisms", "motion", "results",
    "start", "studies", "wheels",
)  # fmt: skip

#: tests that compare what only the absolute formulation does, with the reason of each; each of them fails in relative
#: coordinates, or it does not belong here
EXCEPTIONS: dict[str, str] = {}


def take_relative() -> None:
    """Make the relative formulation that of all that is not given one."""
    from floatframe import linearize, static_equilibrium, steady_rotation
    from floatframe.integrators.generalized_alpha import GeneralizedAlpha
    from floatframe.motion import integration

    for function in (linearize, static_equilibrium, steady_rotation):
        function.__kwdefaults__["formulation"] = "relative"
    given = integration.in_formulation

    @functools.wraps(given)
    def chosen(integrator, formulation):
        if formulation is None and isinstance(integrator, GeneralizedAlpha):
            formulation = "relative"
        return given(integrator, formulation)

    integration.in_formulation = chosen


def select(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep tests of the engine, and expect those that are exceptions to fail."""
    folders = [ROOT / "tests" / "floatframe" / room for room in ROOMS]
    chosen = [item for item in items if any(Path(item.path).is_relative_to(folder) for folder in folders)]
    config.hook.pytest_deselected(items=[item for item in items if item not in set(chosen)])
    for item in chosen:
        reason = EXCEPTIONS.get(f"{Path(item.path).relative_to(ROOT / 'tests' / 'floatframe')}::{item.name}")
        if reason is not None:
            item.add_marker(pytest.mark.xfail(strict=True, reason=reason))
    items[:] = chosen

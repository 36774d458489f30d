"""Every public element, and what laws may ask for, by every scheme, see `test_every_part`."""

from importlib import import_module
from pkgutil import iter_modules

import pytest

import floatframe.components
import floatframe.model
from tests.floatframe.engine.structure_preserving.compared import assert_runs_or_is_refused, cells
from tests.floatframe.engine.structure_preserving.element_parts import ELEMENT_PARTS


@pytest.mark.parametrize(("name", "part"), cells(ELEMENT_PARTS))
def test_an_element_acts_as_by_generalized_alpha_or_is_refused_by_name(name, part):
    assert_runs_or_is_refused(name, part)


def test_every_element_has_its_cells():
    kinds = [
        f"{package}.{kind}" for wing in (floatframe.components, floatframe.model)
        for package in (each.name for each in iter_modules(wing.__path__) if each.ispkg)
        for kind in getattr(import_module(f"{wing.__name__}.{package}"), "ELEMENTS", {})
    ]  # fmt: skip
    assert "wheels.linear-tyre" in kinds
    assert set(kinds) <= set(ELEMENT_PARTS)

"""Every public element, and what laws may ask for, by every scheme, see `test_every_part`."""

from importlib import import_module
from pkgutil import iter_modules

import pytest

import floatframe
from tests.floatframe.engine.structure_preserving.compared import assert_runs_or_is_refused, cells
from tests.floatframe.engine.structure_preserving.element_parts import ELEMENT_PARTS


@pytest.mark.parametrize(("name", "part"), cells(ELEMENT_PARTS))
def test_an_element_acts_as_by_generalized_alpha_or_is_refused_by_name(name, part):
    assert_runs_or_is_refused(name, part)


def test_every_element_has_its_cells():
    packages = [each.name for each in iter_modules(floatframe.__path__) if each.ispkg]
    kinds = [
        f"{package}.{kind}" for package in packages
        for kind in getattr(import_module(f"floatframe.components.{package}"), "ELEMENTS", {})
    ]  # fmt: skip
    assert "wheels.linear-tyre" in kinds
    assert set(kinds) <= set(ELEMENT_PARTS)

"""What a user describes names where it is evaluated, and what evaluates it names the description."""

import ast
import re

import pytest

from floatframe.integrators.registry import CLASSES
from floatframe.joints import CoordinateCoupler
from floatframe.model.elements.element import Element
from floatframe.model.forces import FORCES
from floatframe.model.joints import JOINTS
from tests.import_graph import modules

DESCRIPTIONS = {each.__module__ for each in (*FORCES.values(), *JOINTS.values(), *CLASSES.values())} | {
    CoordinateCoupler.__module__, Element.__module__,
}  # fmt: skip


def named_after(words: str, text: str) -> set[str]:
    """Return the modules that a docstring names after some words, up to the end of the sentence."""
    found = re.search(rf"{words}((?:[\s,]|and|`[\w.]+`)+)\.", text)
    return set(re.findall(r"`([\w.]+)`", found[1])) if found else set()


def pointers(words: str) -> dict[str, set[str]]:
    """Return the modules that name others after some words, and which."""
    found = {}
    for name, path in modules().items():
        text = path.read_text()
        if words in text and (named := named_after(words, ast.get_docstring(ast.parse(text)) or "")):
            found[name] = named
    return found


@pytest.mark.parametrize("module", sorted(DESCRIPTIONS))
def test_a_description_names_its_evaluation(module):
    assert pointers("Evaluated in").get(module, set()) & set(modules())


def test_description_and_evaluation_name_each_other():
    there = {(a, b) for a, names in pointers("Evaluated in").items() for b in names}
    back = {(a, b) for b, names in pointers("Described in").items() for a in names}
    assert there == back
    assert {name for pair in there for name in pair} <= set(modules())

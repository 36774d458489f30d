"""The docstrings of public data classes, which `help` shows, name each field under Parameters."""

import dataclasses
import importlib
import inspect
import re

import pytest

PACKAGES = ("fe_models", "cms", "floatframe")
SECTION = re.compile(r"^Parameters\n-{10}\n(.*?)(?=^[A-Z]\w*( \w+)?\n-{3,}\n|\Z)", re.MULTILINE | re.DOTALL)
ENTRY = re.compile(r"^(\w+)\n {4}\S", re.MULTILINE)


def documented(docstring: str) -> list[str]:
    """Return the parameters of a docstring that have a description, in their order."""
    section = SECTION.search(docstring)
    return ENTRY.findall(section[1]) if section else []


def public_data_classes(package: str) -> list[type]:
    module = importlib.import_module(package)
    named = [getattr(module, name) for name in module.__all__]
    return [each for each in named if inspect.isclass(each) and dataclasses.is_dataclass(each)]


def test_parameters_are_read_with_their_description():
    text = "A body.\n\nParameters\n----------\nmass\n    [kg]\nname\n\nRaises\n------\nModelError\n    If so.\n"
    assert documented(text) == ["mass"]
    assert documented("A body.\n\nmass\n    [kg]\n") == []


@pytest.mark.parametrize("package", PACKAGES)
def test_each_field_of_a_public_data_class_is_described_in_its_docstring(package):
    classes = public_data_classes(package)
    assert classes
    missing = {
        each.__name__: names
        for each in classes
        if (names := {f.name for f in dataclasses.fields(each) if not f.name.startswith("_")})
        != set(found := documented(inspect.getdoc(each) or "")) & names
        or len(found) != len(set(found))
    }
    assert not missing

"""Parameters of public functions and fields of public data classes stand in the section Parameters of the docstring."""

import dataclasses
import inspect
import re
from typing import Any

import pytest

from tests.public_objects import public_objects

PACKAGES = ("fe_models", "cms", "floatframe")


def documented(function: Any) -> set[str]:
    """Return the names that the section Parameters of a docstring explains."""
    sections = re.split(r"\n([A-Z][A-Za-z ]+)\n-{3,}\n", f"\n{inspect.getdoc(function) or ''}\n")
    body = dict(zip(sections[1::2], sections[2::2], strict=True)).get("Parameters", "")
    heads = [line for line in body.splitlines() if line and not line.startswith(" ")]
    return {name.strip(" *") for head in heads for name in head.split(",")}


@pytest.mark.parametrize("package", PACKAGES)
def test_public_functions_document_every_parameter(package):
    functions = {name: each for name, each in public_objects(package).items() if inspect.isfunction(each)}
    assert len(functions) > 30
    missing = {
        name: left
        for name, function in functions.items()
        if (left := set(inspect.signature(function).parameters) - documented(function))
    }
    assert missing == {}, "expected these parameters in the section Parameters, with shape and unit"


@pytest.mark.parametrize("package", PACKAGES)
def test_public_data_classes_document_every_field(package):
    named = public_objects(package).items()
    classes = {name: each for name, each in named if inspect.isclass(each) and dataclasses.is_dataclass(each)}
    assert len(classes) > 30
    missing = {
        name: left
        for name, each in classes.items()
        if (left := {f.name for f in dataclasses.fields(each) if not f.name.startswith("_")} - documented(each))
    }
    assert missing == {}, "expected these fields in the section Parameters, with shape and unit"


def test_help_of_a_rigid_body_names_the_point_of_its_inertia():
    from floatframe import RigidBody

    assert "Inertia tensor about the centre of mass" in inspect.getdoc(RigidBody)

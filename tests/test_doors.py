"""Public names: few at the top of each package, the others in namespaces, each in one place, loaded on first use."""

import importlib
import subprocess
import sys
from types import ModuleType

import pytest

import cms
import fe_models
import floatframe as ff
from fe_models.door import Door, door_names, names_of, namespaces

PACKAGES = ("fe_models", "cms", "floatframe")
MOST = {"fe_models": 30, "cms": 30, "floatframe": 45}  #: names at the top of a package, its namespaces included


@pytest.mark.parametrize("package", PACKAGES)
def test_the_top_of_a_package_has_few_names(package):
    assert len(dir(importlib.import_module(package))) <= MOST[package]


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_object_is_in_one_place(package):
    places = {}
    for module in namespaces(package):
        known = door_names(module) if isinstance(importlib.import_module(module), Door) else {}
        for name in names_of(module):
            places.setdefault(known.get(name, (module, name)), []).append(f"{module}.{name}")
    assert [each for each in places.values() if len(each) > 1] == []


@pytest.mark.parametrize("package", PACKAGES)
def test_no_name_of_the_top_means_something_else_in_a_namespace(package):
    top = set(names_of(package))
    below = [module for module in namespaces(package) if module != package]
    inner = {f"{module}.{name}" for module in below for name in names_of(module) if name in top}
    assert inner - set(below) == set()


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_can_be_loaded(package):
    below = set(namespaces(package))
    for module in below:
        for name in names_of(module):
            found = getattr(importlib.import_module(module), name)
            own = found.__name__ in below if isinstance(found, ModuleType) else getattr(found, "__name__", name) == name
            assert own, f"{module}.{name}: {found}"


def test_a_name_of_a_namespace_is_answered_with_its_place():
    with pytest.raises(AttributeError, match=r"^campbell is in floatframe.analyses: floatframe.analyses.campbell$"):
        _ = ff.campbell
    with pytest.raises(AttributeError, match=r"^RevoluteJoint is in floatframe: floatframe.RevoluteJoint$"):
        _ = ff.joints.RevoluteJoint
    with pytest.raises(AttributeError, match=r"hydraulics.Cylinder or floatframe.shapes.Cylinder$"):
        _ = ff.Cylinder


def test_an_import_of_a_name_of_a_namespace_is_answered_with_its_place():
    with pytest.raises(ImportError, match=r"^Tube is in fe_models.beams: fe_models.beams.Tube$"):
        from fe_models import Tube  # noqa: F401
    with pytest.raises(ImportError, match=r"^RevoluteJoint is in floatframe: "):
        from floatframe.joints import RevoluteJoint  # noqa: F401


@pytest.mark.parametrize("package", [fe_models, cms, ff])
def test_a_name_that_is_nowhere_is_an_attribute_error(package):
    with pytest.raises(AttributeError, match=r"^module '\w+' has no attribute 'nosuch'$"):
        _ = package.nosuch


def test_a_module_below_does_not_hide_a_function_of_its_name():
    code = "import floatframe.analyses.sweep; print(callable(floatframe.analyses.sweep))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True"


def test_functions_of_namespaces_check_their_arguments():
    with pytest.raises(ff.errors.ModelError, match=r"campbell: .*: expected "):
        ff.analyses.campbell(1, 2)


def test_importing_the_packages_loads_no_library_for_numbers():
    code = "import sys, cms, fe_models, floatframe; print([m for m in 'numpy scipy numba'.split() if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_name_is_looked_for_without_loading_anything():
    code = "import sys, floatframe; print(hasattr(floatframe, 'Fluid'), 'numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]

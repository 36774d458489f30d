import subprocess
import sys
import types

import fe_models


def test_every_public_name_can_be_loaded():
    for name in fe_models.__all__:
        found = getattr(fe_models, name)
        assert getattr(found, "__name__", name) == name
        assert not isinstance(found, types.ModuleType), f"{name} is a module, expected what it is named after"


def test_importing_the_package_loads_no_heavy_library():
    heavy = "numpy scipy skfem meshio gmsh"
    code = f"import sys, fe_models; print([m for m in '{heavy}'.split() if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"

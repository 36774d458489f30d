import subprocess
import sys

import fe_models


def test_every_public_name_can_be_loaded():
    for name in fe_models.__all__:
        assert getattr(fe_models, name).__name__ == name


def test_importing_the_package_loads_no_heavy_library():
    heavy = "numpy scipy skfem meshio gmsh"
    code = f"import sys, fe_models; print([m for m in '{heavy}'.split() if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"

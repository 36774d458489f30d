"""The wheel that `.ci/wheel` builds reduces and moves bodies without a compilation, with the results of a checkout."""

import json
import os
import subprocess
import sys
import sysconfig

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.root import ROOT

FAMILY = "x86-64-v3"

#: writes results of a reduction, of motions and of a factor; prints where the package is, and what was compiled
WORK = """
import json, sys
from pathlib import Path
import numpy as np
import scipy.sparse as sp
from numba.core.event import install_recorder
import cms, floatframe as ff
from cms.cli.demo import put_inputs
from cms.linear_algebra.solvers.factorization import lower_triangle
from cms.linear_algebra.sparse_cholesky.factor import CholeskyFactor

folder = Path(sys.argv[1])
put_inputs(folder)
found = {}
with install_recorder("numba:compile") as recorder:
    body = cms.reduce_job(folder / "rod.toml")
    cms.write(body, folder / "rod.h5")
    found["omega²"] = np.sort(np.linalg.eigvalsh(np.linalg.solve(body.M, body.K)))
    system, _ = ff.read_system(folder / "crank.toml")
    for formulation in ("absolute", "relative"):
        motion = ff.integrate(system, ff.GeneralizedAlpha(), 5e-3, 5e-5, formulation=formulation)
        found[f"slider, {formulation}"] = motion.body("slider").r[::10]
    top = ff.System([ff.RigidBody("top", 1.0, np.diag([1.0, 2.0, 2.5]), omega_B=(0.1, 5.0, -2.0))])
    motion = ff.integrate(top, ff.integrators.EnergyMomentum(), 0.1, 1e-3)
    found["top"] = motion.body("top").p[::10]
    line = sp.diags_array([-1.0, 2.1, -1.0], offsets=[-1, 0, 1], shape=(14, 14))
    grid = sp.csc_array(sp.kronsum(sp.kronsum(line, line), line))
    factor = CholeskyFactor(lower_triangle(grid))
    found["solution"] = factor.solve(np.sin(np.arange(2.0 * grid.shape[0])).reshape(-1, 2))
    factor.close()
np.savez(folder / "found.npz", **found)
print(json.dumps({"file": ff.__file__, "compiled": [str(each.data["dispatcher"]) for _, each in recorder.buffer]}))
"""


@pytest.mark.long
def test_a_wheel_reduces_and_moves_bodies_without_a_compilation(tmp_path):
    """In a new virtual environment with the libraries of this one, and with no cache of compiled code."""
    dist, env = tmp_path / "dist", tmp_path / "another env"
    subprocess.run([ROOT / ".ci" / "wheel", dist, FAMILY], check=True, env=os.environ | {"PYTHON": sys.executable})
    (wheel,) = dist.iterdir()
    assert f"cp3{sys.version_info.minor}-cp3{sys.version_info.minor}-manylinux" in wheel.name
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", env], check=True)
    site = env / "lib" / f"python3.{sys.version_info.minor}" / "site-packages"
    subprocess.run([sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", site, wheel], check=True)
    (site / "libraries.pth").write_text(sysconfig.get_paths()["purelib"])

    def work(python, name: str, **settings: str) -> tuple[dict, dict]:
        folder = tmp_path / name
        known = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"} | settings
        command = [python, "-c", WORK, folder]
        done = subprocess.run(command, cwd=tmp_path, env=known, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout.splitlines()[-1]), np.load(folder / "found.npz")

    report, found = work(env / "bin" / "python", "from wheel", NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    assert report == {"file": str(site / "floatframe" / "__init__.py"), "compiled": []}
    report, expected = work(sys.executable, "from checkout", PYTHONPATH=str(ROOT))
    assert report["file"] == str(ROOT / "floatframe" / "__init__.py")
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        assert_allclose(found[name], values, rtol=1e-9, atol=1e-9 * np.abs(values).max(), err_msg=name)

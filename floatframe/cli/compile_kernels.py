"""Compile kernels in advance: `python -m floatframe.cli.compile_kernels [part ...]`; without parts, those of motions.

Numba compiles the kernels once per machine and caches them, each part on one core. A separate process can compile while
another core does other work. Kernels have a single signature, so any system compiles all kernels of a part. The last
printed line reports the result as JSON: `{"compiled": true, "from_package": false, "seconds": 12.3}`.
"""

import json
import logging
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numba.core.event import install_recorder

from fe_models.foundation.kernels import jit
from floatframe.integrators.energy_momentum import EnergyMomentum
from floatframe.integrators.generalized_alpha import GeneralizedAlpha
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.system import System
from floatframe.simulation.integrate import integrate

__all__ = ["PARTS", "main"]


def make_motion() -> None:
    """Move one free rigid body by one step, in absolute coordinates."""
    integrate(block(), GeneralizedAlpha(), 1e-3, 1e-3, formulation="absolute")


def make_relative() -> None:
    """Compute the motion in joint coordinates too; these kernels need the kernels of the motion."""
    make_motion()
    integrate(block(), GeneralizedAlpha(), 1e-3, 1e-3, formulation="relative")


def make_schemes() -> None:
    """Compute the motion by an energy-conserving scheme, whose time loop the variational scheme also uses."""
    integrate(block(), EnergyMomentum(), 1e-3, 1e-3)


def make_recursion() -> None:
    """Compute its equations of motion by recursion."""
    from floatframe.engine.tree.recursive import relative_model

    model = relative_model(block())
    model.mass_matrix(model.positions()[0])


def make_cholesky() -> None:
    """Factorise a matrix by the fronts of this package, as large definite matrices are."""
    import scipy.sparse as sp

    from cms.linear_algebra.solvers.factorization import lower_triangle
    from cms.linear_algebra.sparse_cholesky.factor import CholeskyFactor

    line = sp.diags_array([-1.0, 2.1, -1.0], offsets=[-1, 0, 1], shape=(12, 12))
    of_nodes = sp.kronsum(sp.kronsum(line, line), line)
    lower = lower_triangle(sp.csc_array(sp.kron(of_nodes, np.ones((3, 3))) + 100 * sp.eye_array(3 * 12**3)))
    is_diagonal = lower.indices == np.repeat(np.arange(lower.shape[0]), np.diff(lower.indptr))
    lower.data[~is_diagonal & (np.arange(lower.nnz) % 11 == 0)] = 0.0
    lower.eliminate_zeros()  # as entries that cancel in regular meshes
    factor = CholeskyFactor(lower)
    for columns in (1, 16):
        factor.solve(np.ones((lower.shape[0], columns)))
    factor.close()


def make_reduction() -> None:
    """Reduce the shipped rod, with assembly, stress and geometric stiffness of solids."""
    import cms
    from cms.cli.demo import put_inputs

    with TemporaryDirectory(prefix="kernels-") as folder:
        put_inputs(Path(folder))
        cms.reduce_job(Path(folder) / "rod.toml")


def block() -> System:
    """Return a system of one rigid body."""
    return System([RigidBody("block", 1.0, np.eye(3))])


#: separately compiled parts: a name for the user, and a function that needs the part
PARTS: dict[str, tuple[str, Callable[[], None]]] = {
    "motion": ("motions, equilibria, linearisation", make_motion),
    "relative": ("motions in the coordinates of joints", make_relative),
    "schemes": ("conserving, decaying and variational schemes", make_schemes),
    "recursion": ("equations of motion by recursion", make_recursion),
    "cholesky": ("factors of large matrices", make_cholesky),
    "reduction": ("finite element bodies: assembly, stress, geometric stiffness", make_reduction),
}


def main(parts: Sequence[str] = (), into: Path | None = None) -> None:
    """Compile the parts, and report whether anything was compiled or came with the package.

    With a folder `into`, all parts are compiled, and their code is written there as files that a package can bring
    along (fe_models/foundation/kernels/jit.py); `.ci/wheel` does this for each family of processors.
    """
    began, jit.write_into = time.perf_counter(), into
    with install_recorder("numba:compile") as recorder:
        for part in parts or (PARTS if into else ("motion",)):
            PARTS[part][1]()
    report = {"compiled": len(recorder.buffer) > 0, "from_package": len(jit.came_with_package) > 0}
    print(json.dumps(report | {"seconds": time.perf_counter() - began}))


if __name__ == "__main__":
    logging.disable(logging.WARNING)  # they would say that this can be done in advance
    main(sys.argv[1:])

"""PETSc, SLEPc and MPI for Python; no wheels exist, so they must be built with MPI (docs/cluster_mpi.md)."""

from functools import cache
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType

__all__ = ["missing_petsc", "petsc", "slepc"]

HOW = "benchmarks/install_petsc.sh builds them beside Debian's PETSc (docs/cluster_mpi.md)"


def missing_petsc() -> str:
    """Describe which parts of PETSc are missing; "" if it can be used."""
    lacks = [name for name in ("petsc4py", "slepc4py", "mpi4py") if find_spec(name) is None]
    return f"needs {', '.join(lacks)}, which {'is' if len(lacks) == 1 else 'are'} not installed; {HOW}" if lacks else ""


@cache
def petsc() -> ModuleType:
    """Return petsc4py.PETSc, initialised without command line options."""
    import_module("mpi4py.MPI")  # initialises MPI, and finalises it when the process ends
    import_module("petsc4py").init([])
    PETSc = import_module("petsc4py.PETSc")
    PETSc.Log.begin()  # counts the solves
    return PETSc


@cache
def slepc() -> ModuleType:
    """Return slepc4py.SLEPc."""
    petsc()
    import_module("slepc4py").init([])
    return import_module("slepc4py.SLEPc")

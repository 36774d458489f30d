#!/bin/sh
# PETSc, SLEPc and MUMPS with MPI for `--solver petsc` (docs/cluster_mpi.md): Debian's libraries, and their Python
# modules built against them into the environment of the python that is given.
#
#     sh benchmarks/install_petsc.sh .venv/bin/python
#
# Needs root for apt-get (or sudo), a compiler, and some ten minutes of one processor (6 of them were measured). NumPy 1.26 and 2 both do.
set -eu
python=${1:-python3}
with=$(command -v sudo || true)
$with apt-get update
# Open MPI is the one MPI here: a second one beside it is taken by half of the programs
$with apt-get install -y --no-install-recommends \
    libpetsc-real-dev libslepc-real-dev libopenblas0-pthread openmpi-bin libopenmpi-dev gcc
export PETSC_DIR=/usr/lib/petscdir/petsc3.18/x86_64-linux-gnu-real
export SLEPC_DIR=/usr/lib/slepcdir/slepc3.18/x86_64-linux-gnu-real
export MAKEFLAGS=-j1
# petsc4py 3.18 is written in the Cython of before 3; built in an environment of its own, which is thrown away
build=$(mktemp -d)
trap 'rm -rf "$build"' EXIT
"$python" -m venv "$build/env"
numpy=$("$python" -c "import numpy; print(numpy.__version__)")
"$build/env/bin/pip" install "setuptools<70" wheel "cython<3" "numpy==$numpy"
"$build/env/bin/pip" install --no-build-isolation --no-deps "petsc4py==3.18.5"
"$build/env/bin/pip" install --no-build-isolation --no-deps "slepc4py==3.18.2"
"$build/env/bin/pip" install "mpi4py>=4.1,<5"  # its wheel takes the MPI that it finds when it is loaded
from=$("$build/env/bin/python" -c "import sysconfig; print(sysconfig.get_path('purelib'))")
to=$("$python" -c "import sysconfig; print(sysconfig.get_path('purelib'))")
cp -r "$from"/petsc4py* "$from"/slepc4py* "$from"/mpi4py* "$to"
# Open MPI refuses root, who may be the only user of a container, unless told twice
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
mpirun --oversubscribe -n 2 "$python" -c "
from mpi4py import MPI
from slepc4py import SLEPc
print('rank', MPI.COMM_WORLD.rank, 'of', MPI.COMM_WORLD.size, 'SLEPc', SLEPc.Sys.getVersion())"

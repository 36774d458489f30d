"""Factorisation and block solves: PARDISO against SuperLU, and PARDISO's settings.

    python -m benchmarks.factorization           # both solvers at 0.02 million dofs, the settings at 0.1 million
    python -m benchmarks.factorization 1.62      # element size [mm] of another rod for the settings (0.5 million dofs)

K_II of the tet10 connecting rod with two rigid interfaces held, all in one process, best of three. Columns:
seconds of analysis and of numerical factorisation, stored entries of the factor in millions, and milliseconds per
column of solves of 1, 8, 16 and 60 columns at once.
"""

import sys
import time

import numpy as np

import cms.linear_algebra.solvers.pardiso as pardiso
from benchmarks.eigen import DEFAULT_SIZE, clamped_rod
from cms.linear_algebra.solvers.factorization import lower_triangle
from cms.linear_algebra.solvers.pardiso import PardisoFactor
from cms.linear_algebra.solvers.superlu import SuperLuFactor

SMALL = 5.6  #: mm: about 20 thousand dofs
WIDTHS = (1, 8, 16, 60)

#: indices into iparm, 0-based, against the settings the project uses
SETTINGS = {
    "as used": {},
    "two steps of refinement, PARDISO's default": {7: 2},
    "minimum degree": {1: 0},
    "nested dissection in one thread": {1: 2},
    "reordered for later phases, L = 5": {1: 53},
    "reordered for later phases, L = 10": {1: 103},
    "two-level factorisation": {23: 1},
    "two-level factorisation, improved": {23: 10},
    "sequential solve": {24: 1},
    "parallel solve of many columns": {24: 2},
    "as used, again": {},
}


def timed(action, repeats=1):
    best = np.inf
    for _ in range(repeats):
        start = time.perf_counter()
        result = action()
        best = min(best, time.perf_counter() - start)
    return result, best


def row(name, factor, analysis, numeric, n):
    rng = np.random.default_rng(0)
    per_column = []
    for width in WIDTHS:
        b = np.asfortranarray(rng.standard_normal((n, width)))
        _, seconds = timed(lambda b=b: factor.solve(b), 3)
        per_column.append(f"{1e3 * seconds / width:.1f}")
    entries = factor.n_factor_entries / 1e6
    print(f"| {name} | {analysis} | {numeric} | {entries:.1f} | {' | '.join(per_column)} |", flush=True)


def head(title):
    columns = " | ".join(f"{w} column{'s' * (w > 1)}" for w in WIDTHS)
    print(f"\n| {title} | analysis | factorisation | entries | {columns} |\n|---|---|---|---|---|---|---|---|")


def both_solvers():
    K, _ = clamped_rod(SMALL)
    lower = lower_triangle(K)
    head(f"{K.shape[0]} dofs")
    for name, backend in (("PARDISO", PardisoFactor), ("SuperLU", SuperLuFactor)):
        factor, seconds = timed(lambda backend=backend: backend(lower, definite=True), 3 if name == "PARDISO" else 1)
        row(name, factor, "", f"{seconds:.2f} s (both)", K.shape[0])
        factor.close()


def all_settings(size):
    K, _ = clamped_rod(size)
    lower = lower_triangle(K)
    del K
    head(f"{lower.shape[0]} dofs, PARDISO")
    original = pardiso.settings
    for name, changes in SETTINGS.items():

        def changed(*, definite, changes=changes):
            iparm = original(definite=definite)
            for k, value in changes.items():
                iparm[k] = value
            return iparm

        pardiso.settings = changed
        try:
            factor, analysis, numeric = in_two_phases(lower)
            row(name, factor, f"{analysis:.2f} s", f"{numeric:.2f} s", lower.shape[0])
            factor.close()
        finally:
            pardiso.settings = original


def in_two_phases(lower):
    """Analysis and numerical factorisation apart; PARDISO is asked for both at once by the project."""
    times = {}
    call = PardisoFactor._call

    def apart(self, phase, *columns):
        if phase != pardiso.ANALYSE_AND_FACTORIZE:
            return call(self, phase, *columns)
        _, times["analysis"] = timed(lambda: call(self, 11))
        error, times["numeric"] = timed(lambda: call(self, 22))
        return error

    PardisoFactor._call = apart
    try:
        factor = PardisoFactor(lower, definite=True)
    finally:
        PardisoFactor._call = call
    return factor, times["analysis"], times["numeric"]


if __name__ == "__main__":
    PardisoFactor(lower_triangle(clamped_rod(SMALL)[0]), definite=True).close()  # library and threads awake
    if len(sys.argv) < 2:
        both_solvers()
    all_settings(float(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT_SIZE)

"""The lowest modes of a clamped connecting rod by four methods, with one factorisation and to one tolerance.

    python -m benchmarks.eigen                   # about 0.1 million dofs, 14 and 50 modes
    python -m benchmarks.eigen 0.5               # element size [mm] of a finer or coarser rod in its place: 1.62

tet10, both interfaces rigid (RBE2) and held. All methods share the operator S = K⁻¹ M of one PARDISO factorisation and
stop at a tolerance of 1e-5 in their own measure (LOBPCG after 14 iterations). The residual |x - omega² S x|_M of the
modes returned is measured alike afterwards, and the largest relative error of omega² against a run to 1e-11. "columns"
are right-hand sides solved for, "calls" the solves they came in; "solves" is their time, and "time" the whole without
the factorisation. The methods are

- block Lanczos with full reorthogonalisation, by the width of the block: the project's own;
- ARPACK (`scipy.sparse.linalg.eigsh`): implicitly restarted Lanczos, one column a call;
- LOBPCG (`scipy.sparse.linalg.lobpcg`) with the factorisation as its preconditioner;
- subspace iteration with Rayleigh-Ritz, min(2 k, k + 8) columns, the classical method of structural codes.
"""

import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
import scipy.linalg as la
import scipy.sparse.linalg as sla

import cms.linear_algebra.solvers.mode_search as mode_search
from cms.linear_algebra.solvers.eigen import eigenmodes
from cms.linear_algebra.solvers.factorization import factorize
from fe_models.foundation.sparse.sparse_product import SymmetricProduct
from fe_models.foundation.sparse.submatrix import principal_block
from fe_models.foundation.threads import one_blas_thread

TOLERANCE = 1e-5
BLOCKS = (1, 4, 8, 16, 24, 32)
DEFAULT_SIZE = 2.85  #: mm: 113 thousand dofs


class Counted:
    """A factorisation that counts and times what it solves."""

    def __init__(self, factorization):
        self.factorization = factorization
        self.n, self.description = factorization.n, factorization.description
        self.reset()

    def reset(self):
        """Count from zero."""
        self.columns = self.calls = 0
        self.seconds = 0.0

    @property
    def inertia(self):
        """Signs of the eigenvalues."""
        return self.factorization.inertia

    def solve(self, b):
        """Return A⁻¹ b."""
        self.columns += 1 if b.ndim == 1 else b.shape[1]
        self.calls += 1
        start = time.perf_counter()
        x = self.factorization.solve(b)
        self.seconds += time.perf_counter() - start
        return x


def clamped_rod(size):
    import cms
    import fe_models
    from fe_models.parts import mesh_connecting_rod

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rod.msh"
        mesh_connecting_rod(size=size, path=path)
        mesh = fe_models.read_mesh(path)
    steel = fe_models.Material("steel", E=210e3, nu=0.3, rho=7.85e-9)
    ends = [
        fe_models.rigid_interface(mesh, name, fe_models.selections.FaceGroup(name)) for name in ("big_end", "small_end")
    ]
    body = fe_models.solid_body(mesh, steel, name="rod", units=cms.unit_system("mm-t-s"), interfaces=ends)
    body = cms.couple(body)
    return principal_block(body.K, body.i), principal_block(body.M, body.i)


def lanczos(block):
    def run(K, M, solver, k, tolerance=TOLERANCE):
        before = mode_search.BLOCK, mode_search.WIDE
        mode_search.BLOCK = mode_search.WIDE = block
        try:
            result = eigenmodes(K, M, n_modes=k, factorization=solver, tolerance=tolerance)
        finally:
            mode_search.BLOCK, mode_search.WIDE = before
        return result.omega2, result.Phi

    return run


def arpack(K, M, solver, k):
    inverse = sla.LinearOperator(K.shape, matvec=solver.solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(K.shape[0])
    omega2, Phi = sla.eigsh(K, k, M, sigma=0.0, OPinv=inverse, tol=TOLERANCE, v0=start)
    return omega2, Phi


def lobpcg(K, M, solver, k):
    preconditioner = sla.LinearOperator(K.shape, matvec=solver.solve, matmat=solver.solve, dtype=float)
    start = np.random.default_rng(0).standard_normal((K.shape[0], k + 8))
    # its own residual |K x - omega² M x| has the unit of a force and says nothing here: a fixed number of iterations
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # it warns where it stops at its best
        omega2, Phi = sla.lobpcg(K, start, M, preconditioner, tol=0.0, maxiter=14, largest=False)
    return omega2[:k], Phi[:, :k]


def subspace(K, M, solver, k):
    p = min(2 * k, k + 8)
    product = SymmetricProduct(M)
    X = np.random.default_rng(0).standard_normal((K.shape[0], p))
    M_X = product @ X
    theta = np.zeros(p)
    for _ in range(60):
        Y = solver.solve(M_X)
        H = Y.T @ M_X
        M_Y = product @ Y
        G = Y.T @ M_Y
        mu, Z = la.eigh((H + H.T) / 2, (G + G.T) / 2)
        settled = np.abs(1 / mu[:k] / np.where(theta[:k] > 0, theta[:k], 1e-300) - 1).max()
        theta = 1 / mu
        X, M_X = Y @ Z, M_Y @ Z
        if settled < TOLERANCE**2:  # an error of omega² goes with the square of the residual
            break
    return mu[:k], X[:, :k]


def measure(K, M, solver, run, k, exact):
    solver.reset()
    start = time.perf_counter()
    with one_blas_thread():
        omega2, Phi = run(K, M, solver, k)
    seconds = time.perf_counter() - start
    row = [seconds, solver.seconds, solver.columns, solver.calls]
    Phi = Phi / np.sqrt(np.einsum("nk,nk->k", Phi, M @ Phi))
    R = Phi - solver.factorization.solve(M @ Phi) * omega2
    residual = np.sqrt(np.abs(np.einsum("nk,nk->k", R, M @ R))).max()
    return [*row, residual, np.abs(omega2 / exact - 1).max()]


def main():
    size = float(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT_SIZE
    K, M = clamped_rod(size)
    start = time.perf_counter()
    solver = Counted(factorize(K))
    print(f"{K.shape[0]} dofs; factorisation {time.perf_counter() - start:.1f} s\n")
    lanczos(8)(K, M, solver, 2)  # libraries and threads awake
    for k in (14, 50):
        exact, _ = lanczos(16)(K, M, solver, k, 1e-11)
        print(f"| {k} modes | time | solves | columns | calls | residual | error of omega² |\n{'|---' * 7}|")
        methods = {f"block Lanczos, {block}": lanczos(block) for block in BLOCKS}
        methods |= {"ARPACK": arpack, "LOBPCG, 14 iterations": lobpcg, "subspace iteration": subspace}
        for name, run in methods.items():
            s, solves, columns, calls, residual, error = measure(K, M, solver, run, k, exact)
            print(
                f"| {name} | {s:.1f} s | {solves:.1f} s | {columns} | {calls} | {residual:.0e} | {error:.0e} |",
                flush=True,
            )
        print()


if __name__ == "__main__":
    main()

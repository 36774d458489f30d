import subprocess
import sys

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose, assert_array_equal

from cms.errors import FactorizationError
from cms.linear_algebra.substructures.modes import Interior
from cms.linear_algebra.substructures.reduced_modes import reduced_modes
from cms.linear_algebra.substructures.tree import substructure_tree
from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import MULTIPLIER
from fe_models.foundation.sparse.submatrix import principal_block
from fe_models.foundation.tasks.workers import ThisProcess
from tests.bodies import bar
from tests.cms.linear_algebra.substructures.shells import between
from tests.root import ROOT

NONE = np.zeros(0, dtype=int)


@pytest.fixture(scope="module")
def interior():
    body = couple(bar(nx=10, ny=2, nz=1, kind="hexahedron"))
    i = body.i
    K, M = principal_block(body.K, i), principal_block(body.M, i)
    return Interior(K, M, body.dofs[i, 0], body.nodes, np.zeros(len(i), dtype=bool))


@pytest.fixture(scope="module")
def pencil(interior):
    dissection = interior.dissection(30)
    return dissection, dissection.in_order(interior.K), dissection.in_order(interior.M)


def textbook(dissection, K, M, bound):
    """T of all levels by dense algebra: below a mode of a substructure everything follows statically."""
    first, columns = dissection.first_of_subtrees(), []
    for t in range(dissection.n):
        d = np.arange(dissection.starts[first[t]], dissection.starts[t])
        s = np.arange(dissection.starts[t], dissection.starts[t + 1])
        motion = np.zeros((len(K), len(s)))
        motion[d] = -la.solve(K[np.ix_(d, d)], K[np.ix_(d, s)]) if len(d) else 0.0
        motion[s] = np.eye(len(s))
        omega2, Phi = la.eigh(motion.T @ K @ motion, motion.T @ M @ motion)
        columns.append(motion @ Phi[:, omega2 <= bound])
    return np.hstack(columns)


@pytest.mark.parametrize("leaf", [30, 100])
def test_the_reduced_pencil_is_that_of_the_textbook_in_two_levels_and_in_many(interior, leaf):
    """With two leaves this is Craig-Bampton substructuring with a reduced interface."""
    dissection = interior.dissection(leaf)
    K, M = dissection.in_order(interior.K), dissection.in_order(interior.M)
    bound = np.quantile(la.eigvalsh(K.toarray(), M.toarray()), 0.2)
    tree = substructure_tree(dissection, K, M, bound, multipliers=NONE)
    T = textbook(dissection, K.toarray(), M.toarray(), bound)
    assert T.shape[1] == len(tree.omega2) < len(interior.nodes) / 2
    assert (dissection.n == 3) == (leaf == 100)
    assert_allclose(np.sort(np.diag(T.T @ K @ T)), np.sort(tree.omega2), rtol=1e-9)
    expected = la.eigvalsh(T.T @ K @ T, T.T @ M @ T)
    found, Z = reduced_modes(tree.omega2, tree.mass(), T.shape[1])
    assert_allclose(found, expected, rtol=1e-8)
    X = tree.expand(Z)
    assert_allclose(X.T @ M @ X, np.eye(len(found)), rtol=0, atol=1e-9)
    assert_allclose(X.T @ K @ X, np.diag(found), rtol=0, atol=1e-9 * found.max())


def test_with_all_modes_of_all_substructures_nothing_is_left_out(pencil):
    dissection, K, M = pencil
    exact = la.eigvalsh(K.toarray(), M.toarray())
    tree = substructure_tree(dissection, K, M, 1e3 * exact[-1], multipliers=NONE)
    found, _ = reduced_modes(tree.omega2, tree.mass(), len(exact))
    assert_allclose(found, exact, rtol=1e-8)


def test_the_pencil_in_stages_gives_the_modes_of_the_whole_one(pencil, monkeypatch):
    dissection, K, M = pencil
    exact = la.eigvalsh(K.toarray(), M.toarray())
    tree = substructure_tree(dissection, K, M, 1e3 * exact[-1], multipliers=NONE)
    mass = tree.mass()
    Z = np.random.default_rng(0).standard_normal((mass.n, 3))
    assert_allclose(mass @ Z, mass.toarray() @ Z, rtol=0, atol=1e-12)
    assert_array_equal(mass.toarray(), mass.tocsc().toarray())
    is_kept = np.arange(mass.n) % 3 > 0
    assert_array_equal(mass.of(is_kept).toarray(), mass.toarray()[np.ix_(is_kept, is_kept)])
    M, of = mass.toarray(), np.flatnonzero(is_kept)[::2]
    is_of = np.isin(np.arange(mass.n), of)
    assert_allclose(mass.between(~is_kept, is_of, Z[is_of]), M[np.ix_(~is_kept, is_of)] @ Z[is_of], rtol=0, atol=1e-12)
    monkeypatch.setattr("cms.linear_algebra.substructures.reduced_modes.DENSE", 2)
    monkeypatch.setattr("cms.linear_algebra.substructures.reduced_modes.START", 2)
    found, Z = reduced_modes(tree.omega2, mass, 5)
    assert mass.n > 8 * 2 * 5  # two stages and more
    assert (found >= exact[:5] * (1 - 1e-12)).all()
    assert 1e-12 < (found / exact[:5] - 1).max() < 5e-5  # SETTLED
    assert_allclose(Z.T @ (mass @ Z), np.eye(5), rtol=0, atol=1e-10)


def test_the_tree_solves_as_a_factorisation_does(interior, pencil):
    dissection, K, M = pencil
    tree = substructure_tree(dissection, K, M, 1.0, multipliers=NONE)
    b = np.random.default_rng(0).standard_normal((len(interior.nodes), 130))
    assert len(tree.omega2) == 0
    assert_allclose(tree.solve(b), la.solve(interior.K.toarray(), b), rtol=0, atol=1e-10 * np.abs(tree.solve(b)).max())


def test_subtrees_as_tasks_give_the_tree_of_threads_bit_for_bit(pencil):
    dissection, K, M = pencil
    one, two = (
        substructure_tree(dissection, K, M, 1e12, multipliers=NONE, tasks=tasks) for tasks in (None, ThisProcess())
    )
    assert len(one.omega2) > 0
    assert dissection.n > 3
    assert_array_equal(one.omega2, two.omega2)
    assert_array_equal(one.mass().toarray(), two.mass().toarray())


def test_multipliers_of_distributing_interfaces_stay_in_the_root():
    body = between("distributing")
    i = body.i
    is_multiplier = body.dofs[i, 1] == MULTIPLIER
    assert is_multiplier.sum() == 12
    interior = Interior(
        principal_block(body.K, i), principal_block(body.M, i), body.dofs[i, 0], body.nodes, is_multiplier
    )
    dissection = interior.dissection(60)
    K, M = dissection.in_order(interior.K), dissection.in_order(interior.M)
    multipliers = np.flatnonzero(is_multiplier[dissection.order])
    assert multipliers.min() >= dissection.starts[-2]
    tree = substructure_tree(dissection, K, M, 1e14, multipliers=multipliers)
    b = np.random.default_rng(0).standard_normal((len(i), 3))
    x = tree.solve(b)
    assert_allclose(interior.K @ x, b, rtol=0, atol=1e-7 * np.abs(b).max())
    assert tree.n_negative == 12
    W = np.eye(len(i))
    tree.spread_ordered(W)
    b[is_multiplier[dissection.order]] = 0.0
    spread = (W @ (W.T @ b))[~is_multiplier[dissection.order]]
    unordered = np.empty_like(b)
    unordered[dissection.order] = b
    expected = tree.solve(unordered)[dissection.order][~is_multiplier[dissection.order]]
    assert_allclose(spread, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


SOLVE_IN_THREADS = """
import sys
from concurrent.futures import ThreadPoolExecutor
import numpy as np
import scipy.linalg as la
from cms.linear_algebra.substructures.elimination import Substructure

rng = np.random.default_rng(0)
s = 200
K, x = rng.normal(size=(s, s)), rng.normal(size=(s, 4))
f = K @ x
L, pivots = la.lu_factor(K)
none = np.zeros(0)
root = Substructure(0, none, L, np.zeros((s, 0)), np.zeros((s, 0)), none, np.zeros((0, 0)), (), pivots)

def error(_):
    u = f.copy()
    root.solve_own(u)
    return np.abs(u - x).max()

sys.setswitchinterval(1e-6)
with ThreadPoolExecutor(4) as pool:
    print(np.max(list(pool.map(error, range(2000)))))
"""


def test_threads_share_the_factors_of_a_root_with_multipliers():
    """In a process of its own: LAPACK may write outside its arrays with pivots that another thread shifts."""
    done = subprocess.run([sys.executable, "-c", SOLVE_IN_THREADS], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) < 1e-9


def test_a_singular_stiffness_is_refused(pencil):
    dissection, K, M = pencil
    with pytest.raises(FactorizationError, match="pivot is zero or negative"):
        substructure_tree(dissection, -K, M, 1.0, multipliers=NONE)

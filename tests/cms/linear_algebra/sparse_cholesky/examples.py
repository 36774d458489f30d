"""Systems, bodies and helpers that several tests share: factor."""

import numpy as np
import scipy.sparse as sp


def grid(n, *, dofs=1):
    """Laplacian of a cube of n³ nodes, each with some dofs that feel all dofs of its neighbours."""
    line = sp.diags_array([2.0 * np.ones(n), -np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1, -1])
    one = sp.eye_array(n)
    A = sp.kron(sp.kron(line, one), one) + sp.kron(sp.kron(one, line), one) + sp.kron(sp.kron(one, one), line)
    block = np.eye(dofs) + 0.1 * np.ones((dofs, dofs))
    return sp.csc_array(sp.kron(A, block))

"""Systems, bodies and helpers that several tests share: factorization."""

import numpy as np
import scipy.sparse as sp

from tests.bodies import bar


def clamped_bar():
    """Stiffness of a solid bar, clamped at x = 0."""
    body = bar(nx=6, ny=1, nz=1)
    free = np.flatnonzero(body.nodes[body.dofs[:, 0], 0] > 0)
    return sp.csc_array(body.K[free][:, free])

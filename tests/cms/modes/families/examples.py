"""Systems, bodies and helpers that several tests share: families."""

from dataclasses import replace

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import FEBody, Interface
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from tests.bodies import bar, beam, chain


def three_interface_solid():
    """A bar with rigid ends and a distributing interface at its upper side."""
    body = bar(nx=6, kind="hexahedron")
    side = np.flatnonzero((body.nodes[:, 2] > 0.039) & (np.abs(body.nodes[:, 0] - 0.5) < 0.2))
    return couple(body.with_interfaces(Interface("side", "distributing", side, body.nodes[side].mean(axis=0))))


def random_pencil(seed=0, n_nodes=12):
    """Random mass and random stiffness that spares exactly the rigid-body motions of scattered nodes."""
    rng = np.random.default_rng(seed)
    nodes = rng.normal(size=(n_nodes, 3))
    dofs = np.stack([np.repeat(np.arange(n_nodes), 3), np.tile(np.arange(3), n_nodes)], axis=1)
    n = len(dofs)
    A, B = rng.normal(size=(n, n)), rng.normal(size=(n, n))
    ends = [Interface(f"node {k}", "nodes", np.array([k]), nodes[k]) for k in (1, 4, 7)]
    body = FEBody("random", sp.eye_array(n), sp.eye_array(n), nodes, dofs, tuple(ends))
    spared = np.eye(n) - (Q := la.qr(rigid_motion_of_dofs(body.nodes, body.dofs), mode="economic")[0]) @ Q.T
    return couple(replace(body, K=sp.csc_array(spared @ (A @ A.T + np.eye(n)) @ spared), M=sp.csc_array(B @ B.T / n)))


def planar_beam(n=8):
    """The beam of `tests.bodies` with its dofs in the x-y plane only: ux, uy, rz."""
    full = beam(n)
    kept = np.flatnonzero(np.isin(full.dofs[:, 1], (0, 1, 5)))
    K, M = full.K.toarray()[np.ix_(kept, kept)], full.M.toarray()[np.ix_(kept, kept)]
    return couple(replace(full, K=sp.csc_array(K), M=sp.csc_array(M), dofs=full.dofs[kept]))


BODIES = {
    "beam": lambda: couple(beam()),
    "three interfaces": three_interface_solid,
    "random pencil": random_pencil,
    "planar beam": planar_beam,
    "chain": lambda: couple(chain(9)),
}


def constrained_spectrum(body, held, K_load=None, M_load=None):
    """Squared frequencies by dense algebra with some dofs held, multipliers eliminated by their null space."""
    K, M = body.K.toarray(), body.M.toarray()
    if K_load is not None:
        K[np.ix_(body.b, body.b)] += K_load
        M[np.ix_(body.b, body.b)] += M_load
    multipliers = body.dofs[:, 1] < 0
    x = np.setdiff1d(np.flatnonzero(~multipliers), held)
    C = K[np.ix_(multipliers, x)]
    Z = la.null_space(C / np.abs(C).max()) if len(C) else np.eye(len(x))
    return la.eigh(Z.T @ K[np.ix_(x, x)] @ Z, Z.T @ M[np.ix_(x, x)] @ Z, eigvals_only=True)

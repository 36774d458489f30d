"""Superelements for the tests: a body reduced by us, as plain matrices over boundary dofs and modal coordinates."""

import numpy as np

import cms
from cms.exchange.importers.superelement import RecoveryRows, Superelement
from fe_models.body.fe_body import FEBody
from fe_models.files.matrices.foreign_matrices import SCALAR

FIRST = 101  #: number of the first node


def craig_bampton_matrices(body: FEBody, n_modes: int, name: str = "part") -> tuple[Superelement, np.ndarray]:
    """Return the Craig-Bampton model of a coupled body with recovery at all nodes of its mesh, and its columns V."""
    V = cms.craig_bampton(body, n_modes=n_modes).columns
    n_b = len(body.b)
    assert np.array_equal(V[body.b], np.eye(n_b, V.shape[1]))
    modal = np.stack([1 + np.arange(V.shape[1] - n_b), np.full(V.shape[1] - n_b, SCALAR)], axis=1)
    boundary = body.dofs[body.b] + [FIRST, 0]
    u = body.recovery.matrix @ V if body.recovery is not None else V
    rows = body.recovery.dofs if body.recovery is not None else body.dofs
    element = Superelement(
        name=name,
        K=V.T @ (body.K @ V),
        M=V.T @ (body.M @ V),
        dofs=np.concatenate([boundary, modal]),
        node_numbers=FIRST + np.arange(len(body.nodes)),
        nodes=body.nodes,
        recovery=RecoveryRows(rows + np.array([FIRST, 0]), np.asarray(u)),
        loads={case.name: V.T @ case.f for case in body.load_cases},
        program="our own matrices",
    )
    return element, V

"""Systems, bodies and helpers that several tests share: elements, geometric."""

import numpy as np
from numpy.testing import assert_allclose

from fe_models.body.rigid_motion import MassLoads, rigid_motion_of_dofs
from tests.fe_models.small_shells import of_nodes, solved


def on_dofs(body, forces):
    """Forces over the dofs of the mesh as forces on those of the body."""
    return body.recovery.matrix.T @ forces


def n_shell_nodes(body):
    """Nodes of the cells; sections that turn by themselves have dofs beyond theirs."""
    model = body.element_model
    return getattr(model, "shell", model).n_nodes


def balanced_state(body, seed=1):
    """A load per mass, nodal forces that balance it, and the static response held at no more than six dofs."""
    rng = np.random.default_rng(seed)
    loads = MassLoads(1e3 * rng.normal(size=(1, 3, 3)), 1e3 * rng.normal(size=(1, 3)))
    of_mass = on_dofs(body, body.element_model.mass_forces(loads))[:, 0]
    Psi = rigid_motion_of_dofs(body.nodes, body.dofs)
    nodal = np.zeros(body.n_dof)
    some = rng.choice(6 * n_shell_nodes(body), 40, replace=False)
    nodal[some] = -np.linalg.lstsq(Psi[some].T, Psi.T @ of_mass, rcond=None)[0]
    held = np.concatenate([of_nodes([0], *range(6))])
    u = solved(body, nodal + of_mass, held)
    assert_allclose((body.K @ u - nodal - of_mass), 0, rtol=0, atol=1e-8 * np.abs(nodal).max())
    return loads, nodal, u


def turned_loads(loads, theta):
    """theta × the loads per mass."""
    tilde = np.cross(theta, np.eye(3)).T
    return MassLoads(tilde @ loads.A, loads.b @ tilde.T)


def shell_fields(mesh, u, share):
    """Displacement at top and bottom of corners, middles of sides and centres of a flat grid of quads, by cell."""
    cells = mesh.cells["quad"]
    X, U = mesh.nodes[cells], u.reshape(-1, 6)[cells]
    Theta, normal = U[:, :, 3:], np.array([0.0, 0.0, 1.0])
    used = Theta * np.array([1.0, 1.0, share])  # of the rotations in the sides
    side = [(0, 1), (1, 2), (2, 3), (3, 0)]
    bulge = np.stack([-np.cross(used[:, j] - used[:, i], X[:, j] - X[:, i]) / 8 for i, j in side], axis=1)
    middles = np.stack([(U[:, i, :3] + U[:, j, :3]) / 2 for i, j in side], axis=1) + bulge
    centre = U[:, :, :3].mean(axis=1) + bulge.sum(axis=1) / 2
    turns = np.concatenate([Theta, np.stack([(Theta[:, i] + Theta[:, j]) / 2 for i, j in side], axis=1)], axis=1)
    turns = np.concatenate([turns, Theta.mean(axis=1, keepdims=True)], axis=1)
    values = np.concatenate([U[:, :, :3], middles, centre[:, None]], axis=1)
    places = np.concatenate(
        [X, np.stack([(X[:, i] + X[:, j]) / 2 for i, j in side], axis=1), X.mean(axis=1)[:, None]], axis=1
    )
    return places, values, np.cross(turns, normal)

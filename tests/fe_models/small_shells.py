"""Small shells for tests, and how to hold and load them."""

from dataclasses import replace

import numpy as np
import scipy.sparse.linalg as spla

import cms
import fe_models as fm

STEEL = fm.Material("steel", E=2.0e11, nu=0.3, rho=8000.0)
SI = cms.unit_system("m-kg-s")
KINDS = ("quad", "triangle")


def plate(kind="quad", n=8, a=10.0, b=10.0, t=0.05, *, n_b=None, material=STEEL, **options):
    """A rectangle in the x-y plane as a body."""
    mesh = fm.shells.flat_plate(a, b, n, n_b or n, kind=kind)
    return fm.shell_body(mesh, fm.shells.ShellProperty(t, material), name="plate", units=SI, **options)


def distorted(mesh, amount=0.25, seed=3, warp=0.0):
    """The mesh with inner nodes moved at random, by a share of the shortest side, and all nodes across by `warp`."""
    rng = np.random.default_rng(seed)
    cells = next(iter(mesh.cells.values()))
    X = mesh.nodes[cells]
    h = np.linalg.norm(X - np.roll(X, 1, axis=1), axis=2).min()
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), np.concatenate(list(mesh.node_sets.values())))
    nodes = np.array(mesh.nodes)
    nodes[inner, :2] += amount * h * rng.uniform(-1, 1, (len(inner), 2))
    nodes[:, 2] += warp * h * rng.uniform(-1, 1, len(nodes))
    return replace(mesh, nodes=nodes)


def of_nodes(nodes, *components):
    """Dofs of some components of nodes."""
    return (6 * np.asarray(nodes)[:, None] + np.array(components)).ravel()


def solved(body, f, fixed, values=None):
    """Displacements under nodal forces with some dofs held."""
    u = np.zeros(body.n_dof)
    if values is not None:
        u[fixed] = values
    free = np.setdiff1d(np.arange(body.n_dof), fixed)
    K = body.K.tocsr()
    u[free] = spla.spsolve(K[free][:, free].tocsc(), f[free] - K[free][:, fixed] @ u[fixed])
    return u


def frequencies(body, fixed, k):
    """The lowest k frequencies with some dofs held [Hz]."""
    free = np.setdiff1d(np.arange(body.n_dof), fixed)
    K, M = (A.tocsr()[free][:, free].tocsc() for A in (body.K, body.M))
    shift = -1e-3 * K.diagonal().mean() / M.diagonal().mean()
    v0 = np.random.default_rng(0).normal(size=len(free))
    omega2 = spla.eigsh(K, k, M, sigma=shift, which="LM", return_eigenvectors=False, v0=v0)
    return np.sqrt(np.maximum(np.sort(omega2), 0)) / (2 * np.pi)

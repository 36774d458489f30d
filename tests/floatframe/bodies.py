"""Point-mass bodies: random masses with random shape vectors, whose every integral is a plain sum."""

from dataclasses import dataclass

import numpy as np

from cms.arrays import Array
from cms.invariants import Moments
from cms.reduced_body import BodyFrame, ReducedBody, ReducedInterface
from cms.units import unit_system


@dataclass(frozen=True, eq=False)
class PointMasses:
    """Masses m_i at c_i that move by phi_i,k q_k in the body frame."""

    m: Array  # (n_p,)
    c: Array  # (n_p, 3)
    phi: Array  # (n_p, 3, n_q)

    def moments(self) -> Moments:
        m, c, phi = self.m, self.c, self.phi
        return Moments(
            m=m.sum(),
            S=np.einsum("p,pa->a", m, c),
            R=np.einsum("p,pa,pb->ab", m, c, c),
            C1=np.einsum("p,pak->ak", m, phi),
            P=np.einsum("p,pa,pbk->abk", m, c, phi),
            S_kl=np.einsum("p,pak,pbl->abkl", m, phi, phi),
        )


def random_point_masses(n_q: int, seed: int = 0, *, n_points: int = 40, size: float = 1.0, softness: float = 0.3):
    """Return masses of about one in total in a box; shapes of about `softness` times an M-orthonormal one."""
    rng = np.random.default_rng(seed)
    m = rng.uniform(0.5, 1.5, n_points) / n_points
    c = size * rng.uniform(-1, 1, (n_points, 3)) * [1.0, 0.4, 0.3] + [0.3, 0.1, -0.2]
    return PointMasses(m, c, softness * rng.normal(size=(n_points, 3, n_q)))


def reduced_body(
    points: PointMasses,
    K: Array,
    *,
    D: Array | None = None,
    name: str = "body",
    seed: int = 1,
    interfaces: int = 2,
    rotation_scale: float = 0.3,
    units: str = "m-kg-s",
) -> ReducedBody:
    """Return a reduced body of point masses with some of them as interfaces that also turn."""
    rng = np.random.default_rng(seed)
    n_q = points.phi.shape[2]
    made = []
    for k in range(interfaces):
        p = int(np.argmax(points.c[:, 0]) if k == 0 else np.argmin(points.c[:, 0]) if k == 1 else k)
        Psi = np.vstack([points.phi[p], rotation_scale * rng.normal(size=(3, n_q))])
        made.append(ReducedInterface(f"end_{'abcdefgh'[k]}", "nodes", points.c[p], np.eye(3), Psi, [p]))
    return ReducedBody(
        name=name,
        units=unit_system(units),
        frame=BodyFrame("nodal", np.zeros(3)),
        M=points.moments().M,
        K=K,
        D=np.zeros((n_q, n_q)) if D is None else D,
        labels=[f"mode {k + 1}" for k in range(n_q)],
        energy_shares=np.ones((n_q, 1)),
        sources=("random",),
        moments=points.moments(),
        free_frequencies=np.zeros(0),
        nodes=points.c,
        node_ids=np.arange(len(points.c)),
        Phi=points.phi,
        surface=np.zeros((0, 3), int),
        interfaces=made,
    )


def stiffness(n_q: int, seed: int = 2, *, omega: float = 10.0) -> Array:
    """Return a random positive definite stiffness, frequencies of the order of omega for unit masses."""
    A = np.random.default_rng(seed).normal(size=(n_q, n_q))
    return omega**2 * (A @ A.T / n_q + 0.5 * np.eye(n_q))

"""Point-mass bodies: random masses with random shape vectors, whose every integral is a plain sum."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cms.body.geometric_stiffness import SPIN_PAIRS, GeometricStiffness
from cms.body.invariants import Moments
from cms.body.reduced_body import BodyFrame, ReducedBody, ReducedInterface
from fe_models.foundation.arrays import Array
from fe_models.foundation.units import unit_system


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
        frame=BodyFrame("tisserand", np.zeros(3)),  # said to be, so that the engine moves it as it is
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


@dataclass(frozen=True, eq=False)
class SecondOrder:
    """Displacements of second order of point masses, 1/2 q_k q_l g_i,kl, and what follows from them by plain sums."""

    points: PointMasses
    g: Array  # (n_p, 3, n_q, n_q), symmetric in the modes

    def geometric(self, interfaces: tuple[int, ...], seed: int = 5) -> GeometricStiffness:
        """Return K_j = -Σ f_j·g of the unit loads; interfaces at these points, their moments random."""
        m, c, g = self.points.m, self.points.c, self.g
        e = np.eye(3)

        def of_load(f: Array) -> Array:
            return -np.einsum("pa,pakl->kl", f, g)

        rng = np.random.default_rng(seed)
        moments = rng.normal(size=(len(interfaces), 3, *g.shape[2:])) * np.abs(g).max()
        spin = []
        for a, b in SPIN_PAIRS:
            f = np.cross(e[a], np.cross(e[b], c)) + np.cross(e[b], np.cross(e[a], c))
            spin.append(of_load(-0.5 * m[:, None] * f))
        return GeometricStiffness(
            translation=np.array([of_load(-m[:, None] * e[a]) for a in range(3)]),
            rotation=np.array([of_load(-m[:, None] * np.cross(e[a], c)) for a in range(3)]),
            spin=np.array(spin),
            interfaces=np.concatenate([-g[list(interfaces)], moments + np.swapaxes(moments, 2, 3)], axis=1),
        )


def random_second_order(points: PointMasses, seed: int = 0, *, size: float = 0.3) -> SecondOrder:
    """Return random displacements of second order."""
    n_q = points.phi.shape[2]
    g = size * np.random.default_rng(seed).normal(size=(*points.c.shape, n_q, n_q))
    return SecondOrder(points, g + np.swapaxes(g, 2, 3))


def stiffened_body(points: PointMasses, K: Array, *, size: float = 0.3, seed: int = 0, **options: Any) -> ReducedBody:
    """Return `reduced_body` with the geometric stiffness of random displacements of second order."""
    body = reduced_body(points, K, **options)
    places = tuple(int(interface.members[0]) for interface in body.interfaces)
    return replace(body, geometric=random_second_order(points, seed, size=size).geometric(places))

"""Bodies whose integrals are plain sums over nodes, so that what a writer says can be computed by another road."""

from dataclasses import dataclass, replace

import numpy as np

import cms
from cms.body.invariants import moments_from_gram
from cms.body.reduced_body import ReducedBody
from fe_models.body.material import Material
from tests.bodies import bar

RUBBER = Material("rubber", E=2e7, nu=0.3, rho=1000.0)


@dataclass(frozen=True)
class Cloud:
    """Point masses with shapes: the field integrals of a body, formed node by node."""

    mass: np.ndarray  #: (n,)
    c: np.ndarray  #: (n, 3)
    phi: np.ndarray  #: (n, 3, n_q)

    def kinetic_energy(self, v, omega, q, q_dot) -> float:
        """Of the points at c + phi q that move by v + omega × (c + phi q) + phi q_dot, all in body axes."""
        velocity = v + np.cross(omega, self.c + self.phi @ q) + self.phi @ q_dot
        return 0.5 * float(self.mass @ (velocity**2).sum(axis=1))

    def in_si(self, units) -> "Cloud":
        """The same points in m, kg; shapes have mass^(-1/2)."""
        return Cloud(self.mass * units.mass, self.c * units.length, self.phi * units.mass**-0.5)


def cloud_body(n_q=4, n_nodes=30, seed=3, units="mm-t-s") -> tuple[ReducedBody, Cloud]:
    """A synthetic body and its points."""
    from tests.synthetic import synthetic_reduced_body

    body = synthetic_reduced_body(n_q=n_q, n_nodes=n_nodes, seed=seed, units=units)
    mass = np.random.default_rng(seed).uniform(0.5, 2.0, n_nodes)
    return body, Cloud(mass, np.asarray(body.nodes), np.asarray(body.Phi))


def first_modes(body: ReducedBody, n: int) -> ReducedBody:
    """The body with its first n modes alone."""
    rows = np.r_[0:4, [4 + a * body.n_q + k for a in range(3) for k in range(n)]]
    return replace(
        body, M=body.M[:n, :n], K=body.K[:n, :n], D=body.D[:n, :n], labels=body.labels[:n],
        energy_shares=body.energy_shares[:n], Phi=body.Phi[..., :n], columns=None, nodal_sums=None, load_cases=(),
        moments=moments_from_gram(body.moments.gram[np.ix_(rows, rows)]),
        stress=None if body.stress is None else body.stress[..., :n],
        interfaces=[replace(each, Psi=each.Psi[:, :n]) for each in body.interfaces],
    )  # fmt: skip


def soft_bar(n_modes=4) -> ReducedBody:
    """A soft bar in the frame of its left end: slow, so that a motion takes few steps."""
    body = cms.couple(bar(nx=6, material=RUBBER))
    reduced = cms.reduce(body, cms.craig_bampton(body, n_modes=2), frame=cms.NodalFrame("left"), geometric=False)
    return first_modes(reduced, n_modes)

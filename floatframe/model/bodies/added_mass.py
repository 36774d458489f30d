"""Small masses fixed to interfaces of a reduced body, whose mass and inertia become part of the body.

An added mass moves and rotates with its interface. A particle at rho from the interface node has the position c = p +
rho and the shape phi = Psi_t + Psi_r × rho, so that every inertia moment of the body increases by a sum over particles
(theory.md §5). An inertia tensor is represented by six particles on its principal axes. Compared with a rigid body
fixed to the interface, only terms of second order in the elastic rotation are neglected, and no terms if the mass is at
the interface node.

rod = with_masses(rod, [AddedMass("small_end", 0.3), AddedMass("big_end", 0.5, offset=(0, 0, 0.02), inertia=J)])
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cms.body.geometric_stiffness import SPIN_PAIRS, GeometricStiffness
from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError
from floatframe.model.checked_values import array_of_shape, number

__all__ = ["AddedMass", "second_moments", "with_masses"]


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class AddedMass:
    """A small rigid mass fixed to an interface.

    Parameters
    ----------
    interface
        Name of the interface.
    mass
        Mass [kg].
    offset
        Position of the centre of mass relative to the interface node, in the axes of the interface, (3,) [m].
    inertia
        Inertia tensor about the centre of mass, in the axes of the interface, (3, 3) [kg m²].
    """

    interface: str
    mass: float
    offset: GivenArray = given(np.zeros(3))
    inertia: GivenArray = given(np.zeros((3, 3)))

    def __post_init__(self) -> None:
        where = f"added mass at {self.interface!r}"
        object.__setattr__(self, "mass", number(f"{where}: mass", self.mass, above=0.0))
        object.__setattr__(self, "offset", array_of_shape(f"{where}: offset", self.offset, (3,)))
        J = array_of_shape(f"{where}: inertia", self.inertia, (3, 3))
        object.__setattr__(self, "inertia", J)
        if np.abs(J - J.T).max() > 1e-9 * np.abs(J).max():
            raise ModelError(f"{where}: inertia: expected a symmetric tensor, got {J.tolist()}")
        if np.linalg.eigvalsh(second_moments(J))[0] < -1e-6 * np.abs(J).max():
            raise ModelError(
                f"{where}: inertia: no mass distribution has the principal moments {np.linalg.eigvalsh(J).tolist()}: "
                "none may be negative or exceed the sum of the other two"
            )

    def particles(self) -> tuple[float, Array]:
        """Return the mass of each particle, and their positions relative to the interface node in its axes, (n, 3)."""
        if not self.inertia.any():
            return self.mass, self.offset[None, :]
        values, axes = np.linalg.eigh(second_moments(self.inertia))
        arms = np.sqrt(3 * np.maximum(values, 0.0) / self.mass) * axes  # columns; two particles on each axis
        return self.mass / 6, self.offset + np.concatenate([arms.T, -arms.T])


def second_moments(J: Any) -> Any:
    """Return the second moment ∫ x xᵀ = tr(J)/2 1 - J for an inertia tensor J, (3, 3), of numbers or terms."""
    return 0.5 * np.trace(J) * np.eye(3) - J


def with_masses(body: ReducedBody, masses: Sequence[AddedMass]) -> ReducedBody:
    """Return the body with small masses fixed to its interfaces.

    Modes, stiffness and interfaces stay unchanged. Mass matrix, inertia moments and, if the body has it, the geometric
    stiffness of its inertia loads are increased. The modes are then no longer vibration modes of the free body, and its
    frame is no longer a Tisserand frame; the equations of motion require neither.

    Parameters
    ----------
    body
        The reduced body.
    masses
        Small rigid masses, each at an interface of the body.

    Raises
    ------
    ModelError
        If an interface does not exist.
    """
    moments, M, geometric = body.moments, np.array(body.M), body.geometric
    for part in masses:
        names = [interface.name for interface in body.interfaces]
        if part.interface not in names:
            raise ModelError(
                f"body {body.name!r}: no interface {quoted(part.interface)}{nearest(part.interface, names)}"
            )
        k = names.index(part.interface)
        node = body.interfaces[k]
        m, places = part.particles()
        for place in places:
            rho = node.triad @ place
            c = node.position + rho
            phi = node.Psi[:3] + np.cross(node.Psi[3:], rho, axisa=0, axisb=0, axisc=0)
            moments = replace(
                moments,
                m=moments.m + m,
                S=moments.S + m * c,
                R=moments.R + m * np.outer(c, c),
                C1=moments.C1 + m * phi,
                P=moments.P + m * np.einsum("a,bk->abk", c, phi),
                S_kl=moments.S_kl + m * np.einsum("ak,bl->abkl", phi, phi),
            )
            M = M + m * phi.T @ phi
            if geometric is not None:
                geometric = with_particle(geometric, k, m, c, rho)
    note = ", ".join(f"{part.mass:g} at {part.interface}" for part in masses)
    return replace(
        body,
        M=M,
        moments=moments,
        geometric=None if geometric is None else replace(geometric, turned=None, spread=None),
        free_frequencies=np.zeros(0),
        errors=None,
        columns=None,
        nodal_sums=None,
        provenance={**body.provenance, "added masses": note},
    )


def with_particle(geometric: GeometricStiffness, k: int, m: float, c: Array, rho: Array) -> GeometricStiffness:
    """Return the geometric stiffness with the inertia loads of a particle at rho from the node of interface k.

    Its unit loads (see `GeometricStiffness`) are forces at the particle: a force f, and the moment rho × f, at the
    node.
    """
    if not geometric.is_loaded[k]:
        raise ModelError(
            f"added mass at interface {k}, whose loads are not in the geometric stiffness: its inertia would not "
            "stiffen the body; reduce the body with this interface among geometric_stiffness = [...], or remove the "
            "geometric stiffness (replace(body, geometric=None))"
        )
    K = geometric.of_interface(k)

    def of_force(f: Array) -> Array:
        return np.asarray(np.tensordot(np.concatenate([f, np.cross(rho, f)]), K, axes=1))

    e = np.eye(3)
    twice = [np.cross(e[a], np.cross(e[b], c)) + np.cross(e[b], np.cross(e[a], c)) for a, b in SPIN_PAIRS]
    return replace(
        geometric,
        translation=geometric.translation + np.stack([of_force(-m * e[a]) for a in range(3)]),
        rotation=geometric.rotation + np.stack([of_force(-m * np.cross(e[a], c)) for a in range(3)]),
        spin=geometric.spin + np.stack([of_force(-0.5 * m * x) for x in twice]),
    )

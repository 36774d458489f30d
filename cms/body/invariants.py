"""Inertia invariants of a body with deformation modes, all derived from canonical moments (docs/theory.md §5)."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

import numpy as np

from cms.errors import BodyError
from fe_models.foundation.arrays import Array, frozen, require_finite, tilde
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import ArrayShape, checked_fields, frozen_copies
from fe_models.foundation.words import nearest, quoted

__all__ = [
    "INERTIA_TERMS", "NEGATIVITY", "Moments", "NodalSums", "known_P", "known_S_kl", "moments_from_gram",
    "rigid_mass_of",
]  # fmt: skip


#: Terms that a reduced mass matrix alone does not determine: the symmetric part of P; the part of S_kl that is
#: antisymmetric in a, b; and the part that is symmetric in a, b and traceless. The rest of P and S_kl is 2C and M*.
INERTIA_TERMS = ("3C", "4C", "5C")
#: key of the provenance: `Moments.negativity` of a model that has inertia without a distribution of its mass
NEGATIVITY = "negativity of the moments"


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class Moments:
    """Canonical moments of a body about the origin of its frame B [1]_.

    c is the undeformed position and phi_k the translation of shape k, both in B; integrals are over mass. Shapes are
    dimensionless if q is a length. With M-orthonormal shapes, phi has the unit 1/sqrt(kg) and q has sqrt(kg) m.

    A body reduced by another program may not provide all moments. `missing` then names the invariants that do not
    follow. The corresponding parts of P and S_kl are zero, and access to such an invariant raises `BodyError`.

    Parameters
    ----------
    m
        Mass, ∫ 1 [kg].
    S
        First moment, ∫ c_a, (3,) [kg m].
    R
        Second moment, ∫ c_a c_b, (3, 3) [kg m²].
    C1
        1C, ∫ phi_a,k, (3, n_q) [kg].
    P
        Moments of places and shapes, ∫ c_a phi_b,k, (3, 3, n_q) [kg m].
    S_kl
        Moments of shapes, ∫ phi_a,k phi_b,l, (3, 3, n_q, n_q) [kg].
    is_exact
        Whether the moments are exact; False: they follow from bare matrices that are not M_s ⊗ 1.
    missing
        Unknown terms of `INERTIA_TERMS`, in their order.

    References
    ----------
    .. [1] Wallrapp (1994), docs/bibliography.md, has them as standard input data; derived in docs/theory.md §5.
    """

    m: float
    S: Annotated[Array, ArrayShape((3,))]
    R: Annotated[Array, ArrayShape((3, 3))]
    C1: Annotated[Array, ArrayShape((3, "n_q"))]
    P: Annotated[Array, ArrayShape((3, 3, "n_q"))]
    S_kl: Annotated[Array, ArrayShape((3, 3, "n_q", "n_q"))]
    is_exact: bool = True
    missing: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for term in self.missing:
            if term not in INERTIA_TERMS:
                raise BodyError(f"moments: missing: unknown term {quoted(term)}{nearest(term, INERTIA_TERMS)}")
        lost = {*self.missing, "5C"} if "4C" in self.missing else {*self.missing}  # 4C is contained in 5C
        missing = tuple(term for term in INERTIA_TERMS if term in lost)
        object.__setattr__(self, "missing", missing)
        if missing:
            object.__setattr__(self, "P", frozen(known_P(self.P, missing)))
            object.__setattr__(self, "S_kl", frozen(known_S_kl(self.S_kl, missing)))
        object.__setattr__(self, "m", float(self.m))
        require_finite("moments: m", np.array(self.m))

    @property
    def n_q(self) -> int:
        """Number of shapes."""
        return self.C1.shape[1]

    @property
    def center_of_mass(self) -> Array:
        """Undeformed centre of mass in B, (3,) [m]."""
        return self.S / self.m

    @cached_property
    def negativity(self) -> float:
        """Smallest eigenvalue of the Gram matrix about the centre of mass, divided by the largest, if negative; else 0.

        The matrix is scaled to a unit diagonal. The Gram matrix of a mass distribution has no negative eigenvalue. The
        inertia of some models, such as bars without rotary inertia of bending, has no mass distribution.
        """
        L = np.eye(4 + 3 * self.n_q)
        L[1:4, 0] = -self.center_of_mass
        gram = L @ self.gram @ L.T
        diagonal = np.abs(np.diag(gram))
        size = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
        values = np.linalg.eigvalsh((gram + gram.T) / 2 / np.outer(size, size))
        least = float(values[0] / np.abs(values).max())
        return -least if least < -len(values) * np.finfo(float).eps else 0.0

    @cached_property
    def J0(self) -> Array:
        """Inertia tensor of the undeformed body about the frame origin, tr(R) 1 - R, (3, 3) [kg m²]."""
        return frozen(np.trace(self.R) * np.eye(3) - self.R)

    @cached_property
    def C2(self) -> Array:
        """2C, ∫ c × phi_k, (3, n_q) [kg m]."""
        P = self.P
        return frozen(np.stack([P[1, 2] - P[2, 1], P[2, 0] - P[0, 2], P[0, 1] - P[1, 0]]))

    @property
    def rigid_mass(self) -> Array:
        """Mass matrix of the undeformed body for translation and rotation about the frame origin, (6, 6)."""
        return rigid_mass_of(self.m, self.S, self.J0)

    @property
    def coupling(self) -> Array:
        """Momentum and angular momentum of the shapes, [1C; 2C], (6, n_q)."""
        return np.vstack([self.C1, self.C2])

    @cached_property
    def C3(self) -> Array:
        """3C_k = ∫ (c·phi_k 1 - phi_k cᵀ) = tr(P_k) 1 - P_kᵀ, (n_q, 3, 3) [kg m]."""
        self.require("3C")
        P_k = np.moveaxis(self.P, 2, 0)
        return frozen(np.trace(P_k, axis1=1, axis2=2)[:, None, None] * np.eye(3) - P_k.transpose(0, 2, 1))

    @cached_property
    def C4(self) -> Array:
        """4C_kl = ∫ phi_l × phi_k, (n_q, n_q, 3) [kg]; antisymmetric in k, l."""
        self.require("4C")
        S = self.S_kl
        # (phi_l × phi_k)_x = phi_y,l phi_z,k - phi_z,l phi_y,k, and S[a, b, l, k] = ∫ phi_a,l phi_b,k
        return frozen(np.stack([(S[1, 2] - S[2, 1]).T, (S[2, 0] - S[0, 2]).T, (S[0, 1] - S[1, 0]).T], axis=-1))

    @cached_property
    def C5(self) -> Array:
        """5C_kl = ∫ (phi_k·phi_l 1 - phi_l phi_kᵀ), (n_q, n_q, 3, 3) [kg]; half its antisymmetric part is 4C."""
        self.require("5C")
        S, C5 = self.S_kl, np.empty((self.n_q, self.n_q, 3, 3))
        for a in range(3):
            for b in range(3):
                C5[:, :, a, b] = self.M - S[a, b].T if a == b else -S[a, b].T
        return frozen(C5)

    @cached_property
    def M(self) -> Array:
        """M*_kl = ∫ phi_k · phi_l, (n_q, n_q) [kg]."""
        return frozen(np.einsum("aakl->kl", self.S_kl))

    def require(self, *terms: str) -> None:
        """Raise `BodyError` if one of the given `INERTIA_TERMS` is missing."""
        missing = [term for term in terms if term in self.missing]
        if missing:
            raise BodyError(
                f"moments: {', '.join(missing)} of this body {'is' if len(missing) == 1 else 'are'} missing: the "
                "program that reduced it did not write them, and they do not follow from reduced matrices. Import the "
                "body again and also give its full mass matrix, nodal masses, or mesh and density (cms import)"
            )

    @property
    def trust(self) -> str:
        """Describe for which motions the known inertia terms are sufficient."""
        if not self.missing:
            return "every motion"
        exact = "exact: mass, frequencies, static answers, and motions to first order in speeds and deformation"
        if "3C" in self.missing:
            return (
                f"{exact}; not known: the loads of a spin on the deformation, of the order (speed of rotation / lowest "
                "angular frequency)² times the size of the body, and how deformation changes the inertia"
            )
        return (
            f"{exact}, and the loads of a spin on the undeformed body; not known: how a spin changes the stiffness, by "
            "the order (speed of rotation / lowest angular frequency)², and the inertia of second order"
        )

    @property
    def left_out(self) -> "Moments":
        """Moments for a motion that neglects the missing terms, so that these do not change the inertia.

        Missing terms are zero, including the trace of a missing 5C. M* then only comes from `ReducedBody.M`.
        """
        S_kl = np.array(self.S_kl)
        if "5C" in self.missing:
            S_kl = (S_kl - S_kl.swapaxes(0, 1)) / 2
        return replace(self, S_kl=S_kl, missing=())

    @property
    def gram(self) -> Array:
        """The Gram matrix ∫ a aᵀ dm with a = [1, c, phi_x, phi_y, phi_z], (4 + 3 n_q, 4 + 3 n_q), of these moments.

        Missing parts are zero.
        """
        n = self.n_q
        gram = np.zeros((4 + 3 * n, 4 + 3 * n))
        gram[0, 0], gram[0, 1:4], gram[1:4, 1:4] = self.m, self.S, self.R
        gram[0, 4:] = self.C1.reshape(-1)
        gram[1:4, 4:] = self.P.reshape(3, -1)
        gram[4:, 4:] = self.S_kl.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n)
        gram[1:4, 0], gram[4:, :4] = gram[0, 1:4], gram[:4, 4:].T
        return gram

    def inertia(self, q: Array) -> Array:
        """Return J(q) = J0 + Σ q_k (3C_k + 3C_kᵀ) + Σ q_k q_l 5C_kl, (3, 3) [kg m²], symmetric."""
        linear = np.einsum("k,kab->ab", q, self.C3)
        return self.J0 + linear + linear.T + np.einsum("k,l,klab->ab", q, q, self.C5)


def rigid_mass_of(m: float, S: Array, J: Array) -> Array:
    """Return [m 1, -S~; S~, J] of mass, first moment and inertia about one point, (6, 6)."""
    return np.block([[m * np.eye(3), tilde(S).T], [tilde(S), J]])


def known_P(P: Array, missing: Iterable[str]) -> Array:
    """Return P, (3, 3, n_q), with missing terms set to zero; the antisymmetric part (2C) is always known."""
    if "3C" not in missing:
        return P
    return np.asarray((P - P.swapaxes(0, 1)) / 2)


def known_S_kl(S_kl: Array, missing: Iterable[str]) -> Array:
    """Return S_kl, (3, 3, n_q, n_q), with missing terms set to zero.

    Its trace over a, b, which is M*, is always known.
    """
    if "5C" not in missing:  # 4C is then known too
        return S_kl
    M = np.einsum("aakl->kl", S_kl) / 3
    known = np.zeros_like(S_kl)
    for a in range(3):
        known[a, a] = M
    if "4C" not in missing:
        known += (S_kl - S_kl.swapaxes(0, 1)) / 2
    return known


def moments_from_gram(gram: Array, *, is_exact: bool = True, missing: tuple[str, ...] = ()) -> Moments:
    """Extract the canonical moments from the Gram matrix ∫ a aᵀ dm, a = [1, c, phi_x, phi_y, phi_z].

    Parameters
    ----------
    gram
        Gram matrix, (4 + 3 n_q, 4 + 3 n_q); components of all shapes are grouped: all x, then all y, then all z.
    is_exact, missing
        As in `Moments`.
    """
    n = (gram.shape[0] - 4) // 3
    # symmetric by definition; the averaged halves differ only by rounding
    first = (gram[:4] + gram[:, :4].T) / 2  # rows of 1 and c in the Gram matrix
    phi_phi = gram[4:, 4:].reshape(3, n, 3, n).transpose(0, 2, 1, 3)
    S_kl = np.empty((3, 3, n, n))
    np.add(phi_phi, phi_phi.transpose(1, 0, 3, 2), out=S_kl)
    S_kl /= 2
    return Moments(
        m=float(gram[0, 0]),
        S=first[0, 1:4],
        R=first[1:, 1:4],
        C1=first[0, 4:].reshape(3, n),
        P=first[1:, 4:].reshape(3, 3, n),
        S_kl=S_kl,
        is_exact=is_exact,
        missing=missing,
    )


# sums over the nodes of a body, weighted with nodal volume: the norm of a Buckens frame (theory.md §4) ----------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class NodalSums:
    """Sums over all nodes with weights w, about the origin of a frame B; only translations count.

    They are the parts of [1, c]ᵀ W [1, c, Phi] from which a Buckens frame computes the rigid motion C that it removes.
    """

    w: float  #: sum of the weights [m³, or dimensionless if all nodes have equal weight]
    S: Annotated[Array, ArrayShape((3,))]  #: Σ w c, first moment of the weights [w times m]
    R: Annotated[Array, ArrayShape((3, 3))]  #: Σ w c_a c_b, second moment of the weights [w times m²]
    U1: Annotated[Array, ArrayShape((3, "n_q"))]  #: Σ w phi_k [w times unit of phi]
    U2: Annotated[Array, ArrayShape((3, "n_q"))]  #: Σ w c × phi_k [U1 times m]
    is_volume: bool = True  #: whether the weight of a node is its volume; if not, every node has weight 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "w", float(self.w))
        require_finite("nodal sums: w", np.array(self.w))
        if not self.w > 0:
            raise BodyError(f"nodal sums: w: expected a positive sum of weights, got {self.w:g}")

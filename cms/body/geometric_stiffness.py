"""Reduced geometric stiffness for unit loads, which a linear floating frame neglects (docs/theory.md §7)."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from cms.errors import BodyError
from fe_models.foundation.arrays import Array, IntArray, require_shape
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import ArrayShape, checked_fields, frozen_copies
from fe_models.foundation.units import Units

__all__ = ["SPIN_PAIRS", "UNIT_LOADS", "GeometricStiffness", "RotatedLoads", "SpreadLoads", "stiffness_of_loads"]

#: kinds of unit loads; each is an array of `GeometricStiffness`
UNIT_LOADS = ("translation", "rotation", "spin", "interfaces")

#: index pairs (a, b) of the products omega_a omega_b, in the order of `spin`
SPIN_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class RotatedLoads:
    """K_j between a rotation of the whole body and a mode: work on mode k of the balanced load j rotated with the body.

    It is (e_x × c)ᵀ K_geo(sigma_j) phi_k for rotations about the axes x of B. With it, K_j is transformed to the shapes
    of another frame, phi - Psi_R C. For translations it is zero, and for two rotations it follows from the load.

    Parameters
    ----------
    translation
        Matrices of the translations, (3, 3, n_q) [sqrt(kg) per q].
    rotation
        Matrices of the rotations, (3, 3, n_q) [sqrt(kg) m per q].
    spin
        Matrices of the products of angular velocities, (6, 3, n_q) [sqrt(kg) m per q].
    interfaces
        Matrices of the loads of interfaces, (n_loaded, 6, 3, n_q) [1/sqrt(kg) and 1/(sqrt(kg) m) per q].
    """

    translation: Annotated[Array, ArrayShape((3, 3, "n_q"))]
    rotation: Annotated[Array, ArrayShape((3, 3, "n_q"))]
    spin: Annotated[Array, ArrayShape((6, 3, "n_q"))]
    interfaces: Annotated[Array, ArrayShape(("n_loaded", 6, 3, "n_q"))]


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class SpreadLoads:
    """Six loads distributed over the nodes with weights w_i, w = Σ w_i: the reaction of a Buckens frame (theory.md §7).

    Load a = 0-2 is the force (w_i/w) e_a at every node, and load 3 + a is the force (w_i/w) e_a × c_i. `NodalSums` has
    their resultants, which do not suffice to rotate the loads: a node transmits forces on its followers as a force and
    a moment, and a moment counts by half when it is rotated.

    Parameters
    ----------
    K
        Matrices as in `GeometricStiffness`, (6, n_q, n_q) [1/(kg m) and 1/kg per q²].
    turned
        Matrices as in `RotatedLoads`, (6, 3, n_q) [1/sqrt(kg) and m/sqrt(kg) per q].
    turned_rigid
        Work of load j alone, rotated about an axis, on the rotations e_b × c, (6, 3, 3) [m and m²].
    """

    K: Annotated[Array, ArrayShape((6, "n_q", "n_q"), is_symmetric=True)]
    turned: Annotated[Array, ArrayShape((6, 3, "n_q"))]
    turned_rigid: Annotated[Array, ArrayShape((6, 3, 3))]


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class GeometricStiffness:
    """K_j,kl = [Phi.T K_geo(sigma_j) Phi]_kl for unit loads f_j; sigma_j is the stress of the static response [1]_.

    All arrays are in the frame B of the reduced body, over its modes q, with the same support for all loads (theory.md
    §7). A tensile stress makes K_j positive. 1/2 qᵀ K_j q is minus the work of f_j on the second-order displacement.

    Parameters
    ----------
    translation
        K_t,a, unit load -rho e_a: frame acceleration minus gravity, (3, n_q, n_q) [1/m per q²].
    rotation
        K_r,a, unit load -rho e_a × c: angular acceleration, (3, n_q, n_q) [1 per q²].
    spin
        K_ab for unit load -rho/2 [e_a × (e_b × c) + e_b × (e_a × c)], (a, b) as in `SPIN_PAIRS`, (6, n_q, n_q) [1 per
        q²].
    interfaces
        Matrices for a unit force (3) and a unit moment (3) at each loaded interface, axes of B, (n_loaded, 6, n_q, n_q)
        [1/(kg m) and 1/(kg m²) per q²].
    turned
        Rotated loads, with which the matrices are transformed to other frames; None: not recorded, a rotation is then
        assumed to rotate the loads.
    spread
        Distributed loads, with which the matrices are transformed to a Buckens frame; None: left out, or not recorded.
    is_loaded
        Whether the loads of each of `ReducedBody.interfaces` are in `interfaces`; loads of other interfaces do not
        stiffen the body; empty: all are included.

    References
    ----------
    .. [1] Schwertassek & Wallrapp (1999), docs/bibliography.md; derived in docs/theory.md §7.
    """

    translation: Annotated[Array, ArrayShape((3, "n_q", "n_q"), is_symmetric=True)]
    rotation: Annotated[Array, ArrayShape((3, "n_q", "n_q"), is_symmetric=True)]
    spin: Annotated[Array, ArrayShape((6, "n_q", "n_q"), is_symmetric=True)]
    interfaces: Annotated[Array, ArrayShape(("n_loaded", 6, "n_q", "n_q"), is_symmetric=True)]
    turned: RotatedLoads | None = None
    spread: SpreadLoads | None = None
    is_loaded: tuple[bool, ...] = ()

    def __post_init__(self) -> None:
        n, n_loaded = self.n_q, len(self.interfaces)
        object.__setattr__(self, "is_loaded", tuple(bool(each) for each in self.is_loaded) or (True,) * n_loaded)
        if sum(self.is_loaded) != n_loaded:
            raise BodyError(f"geometric stiffness: {sum(self.is_loaded)} loaded interfaces, but matrices of {n_loaded}")
        if self.turned is not None:
            require_shape("turned loads: interfaces", self.turned.interfaces, (n_loaded, 6, 3, n))
        if self.spread is not None:
            require_shape("spread loads: K", self.spread.K, (6, n, n))
            if self.turned is None:
                raise BodyError("spread loads: expected turned loads too, which their change of frame needs")

    @property
    def n_q(self) -> int:
        """Number of modes."""
        return int(np.asarray(self.translation).shape[-1])

    @property
    def loaded(self) -> IntArray:
        """Interfaces whose loads are in `interfaces`, in their order, (n_loaded,)."""
        return np.flatnonzero(self.is_loaded)

    def of_interface(self, k: int) -> Array:
        """Return the matrices of interface k, (6, n_q, n_q); zero, without using memory, if its loads are omitted."""
        if not self.is_loaded[k]:
            return np.broadcast_to(np.zeros(()), (6, self.n_q, self.n_q))
        return np.asarray(self.interfaces[sum(self.is_loaded[:k])])

    def transformed(self, Z: Array) -> "GeometricStiffness":
        """Return the matrices Zᵀ K_j Z for new shapes Phi Z; Z is (n_q, n_new)."""
        return self._changed(lambda K: np.asarray(Z.T @ K @ Z), lambda turned: np.asarray(turned @ Z))

    def of_modes(self, modes: IntArray) -> "GeometricStiffness":
        """Return the matrices restricted to some of the modes, in the given order."""
        pick = np.asarray(modes, dtype=np.int64)
        return self._changed(lambda K: K[..., pick[:, None], pick], lambda turned: turned[..., pick])

    def _changed(self, squares: Callable[[Array], Array], rows: Callable[[Array], Array]) -> "GeometricStiffness":
        """Apply `squares` to the mode-mode matrices, and `rows` to the rotation-mode matrices."""
        turned, spread = self.turned, self.spread
        if turned is not None:
            turned = replace(turned, **{name: rows(getattr(turned, name)) for name in UNIT_LOADS})
        if spread is not None:
            spread = replace(spread, K=squares(spread.K), turned=rows(spread.turned))
        of_loads: dict[str, Any] = {name: squares(getattr(self, name)) for name in UNIT_LOADS}
        return replace(self, **of_loads, turned=turned, spread=spread)

    def in_units(self, old: Units, new: Units) -> "GeometricStiffness":
        """Return the same matrices in other units; qᵀ K_j q times the load amplitude is an energy."""
        length, mass = old.length / new.length, old.mass / new.mass
        q = np.sqrt(mass) * length  # factor for each index of a mode that a matrix has less than two
        force = 1 / (mass * length)  # factor on the mode-mode matrix of a unit force
        of_wrench = force * np.array([1.0, 1, 1, 1 / length, 1 / length, 1 / length])[:, None, None]
        by_load = {"translation": 1 / length, "rotation": 1.0, "spin": 1.0, "interfaces": of_wrench}
        turned, spread = self.turned, self.spread
        if turned is not None:
            turned = replace(turned, **{name: getattr(turned, name) * by * q for name, by in by_load.items()})
        if spread is not None:
            by = force * np.array([1.0, 1, 1, length, length, length])[:, None, None]
            spread = SpreadLoads(spread.K * by, spread.turned * by * q, spread.turned_rigid * by * q**2)
        of_loads: dict[str, Any] = {name: getattr(self, name) * by for name, by in by_load.items()}
        return replace(self, **of_loads, turned=turned, spread=spread)


def stiffness_of_loads(
    K: Array, turned: Array | None, turned_rigid: Array | None, *, is_loaded: tuple[bool, ...]
) -> GeometricStiffness:
    """Return the geometric stiffness, given the matrices of all unit loads in one array.

    Parameters
    ----------
    K, turned
        Matrices over two modes, (k, n_q, n_q), and over a rotation and a mode, (k, 3, n_q). The order is 3
        translations, 3 rotations, 6 products of angular velocities, 6 for each loaded interface, and, if `turned_rigid`
        is given, 6 loads distributed over the nodes.
    turned_rigid
        As in `SpreadLoads`.
    is_loaded
        As in `GeometricStiffness`.
    """
    spread, n_loaded = None, sum(is_loaded)
    if turned is not None and turned_rigid is not None:
        spread = SpreadLoads(K[-6:], turned[-6:], turned_rigid)
    return GeometricStiffness(
        **by_kind(K, n_loaded),
        turned=None if turned is None else RotatedLoads(**by_kind(turned, n_loaded)),
        spread=spread,
        is_loaded=is_loaded,
    )


def by_kind(K: Array, n_loaded: int) -> dict[str, Array]:
    """Split the matrices of the first 12 + 6 n_loaded loads by kind of load."""
    translation, rotation, spin, interfaces, _ = np.split(K, [3, 6, 12, 12 + 6 * n_loaded])
    interfaces = interfaces.reshape(n_loaded, 6, *K.shape[1:])
    return dict(zip(UNIT_LOADS, (translation, rotation, spin, interfaces), strict=True))

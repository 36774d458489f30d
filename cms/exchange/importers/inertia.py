"""Inertia that a reduced mass matrix lacks, from additional data: full mass, nodal masses, a mesh."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from cms.body.invariants import INERTIA_TERMS, Moments, moments_from_gram
from cms.body.reduced_body import BodyFrame
from cms.errors import ForeignBodyError
from cms.reduction.basis.matrix_moments import gram_from_matrices
from fe_models.body.fe_body import FEBody, dofs_of
from fe_models.body.material import Material
from fe_models.elements.solids.body import solid_body
from fe_models.files.matrices.foreign_matrices import ForeignMatrices
from fe_models.files.matrices.given import ScalarMassModel, scalar_mass_of
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.units import Units
from fe_models.meshes.mesh import Mesh

__all__ = [
    "FullMass", "Inertia", "MeshMass", "NodalMasses", "completed", "full_mass_of", "moments_in_frame",
    "moments_of_masses",
]  # fmt: skip

EXACT = 1e-6  #: relative difference between quantities from two routes, up to which they agree
#: relative differences beyond which the data belong to two bodies; lumping changes second moments by some per cent
OTHER_BODY = {"mass": 0.02, "first moment": 0.1, "second moment": 0.1}

#: function from (node number, component) rows to shapes in basic axes, (n_rows, n_q)
Shapes = Callable[[IntArray], Array]


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class FullMass:
    """Mass matrix of the full model, over dofs that the superelement can recover.

    Parameters
    ----------
    M
        Mass matrix with both triangles, basic axes, (n_full, n_full).
    dofs
        (node number, component 0-5) of every row, (n_full, 2).
    places
        Position of each node by its number, basic axes, (3,).
    """

    M: sp.csc_array
    dofs: IntArray
    places: Mapping[int, Array]


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class NodalMasses:
    """Point masses at nodes that the superelement can recover, such as a lumped mass matrix.

    Parameters
    ----------
    node_numbers
        The user's numbers of the nodes, (n,).
    masses
        Masses of the nodes, (n,).
    """

    node_numbers: IntArray
    masses: Array


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class MeshMass:
    """Mesh of the original model and its density; the superelement can recover its nodes.

    Parameters
    ----------
    mesh
        Mesh of the body, with its elements.
    density
        Density of all cells, or group name -> density.
    """

    mesh: Mesh
    density: float | Mapping[str, float]


Inertia = FullMass | NodalMasses | MeshMass


def full_mass_of(foreign: ForeignMatrices) -> FullMass:
    """Return the full mass matrix from imported matrices.

    Raises
    ------
    ForeignBodyError
        If mass or the list of dofs is missing.
    """
    if foreign.M is None or foreign.dofs is None:
        what = "M" if foreign.M is None else "the list of dofs of its rows"
        raise ForeignBodyError(f"full mass: {what} is missing; also give the file that contains it")
    places = {}
    if foreign.nodes is not None and foreign.node_numbers is not None:
        places = dict(zip(map(int, foreign.node_numbers), np.asarray(foreign.nodes), strict=True))
    return FullMass(foreign.M, foreign.dofs, places)


def moments_of_masses(
    inertia: Inertia, shapes: Shapes, places: Mapping[int, Array], units: Units, frame: BodyFrame
) -> tuple[Moments, str]:
    """Return all moments of the shapes from the given masses, and a description of these masses.

    Parameters
    ----------
    shapes
        Shapes of the body, without rigid motion, in basic axes.
    places
        Node number -> position, for all nodes of the superelement.

    Raises
    ------
    ForeignBodyError
        If a node with mass is not recovered, or has another position.
    """
    if isinstance(inertia, NodalMasses):
        numbers, mass = np.asarray(inertia.node_numbers), np.asarray(inertia.masses, dtype=float)
        if len(numbers) != len(mass) or not len(mass) or not np.isfinite(mass).all() or (mass < 0).any():
            raise ForeignBodyError("nodal masses: expected a node number and a mass above zero in each row")
        known = {int(number) for number in places}
        lost = [int(number) for number in numbers if int(number) not in known]
        if lost:
            raise ForeignBodyError(f"nodal masses: nodes {lost[:6]} are not among those of the superelement")
        c = np.array([places[int(number)] for number in numbers])
        phi = shapes(dofs_of(numbers, 3)).reshape(len(numbers), 3, -1)
        n = phi.shape[2]
        a = np.concatenate([np.ones((len(c), 1)), c, phi.reshape(len(c), 3 * n)], axis=1)
        gram, is_exact, words = np.asarray(a.T @ (mass[:, None] * a)), False, f"{len(mass)} nodal masses"
    elif isinstance(inertia, FullMass):
        gram, is_exact = gram_of_full_mass(inertia, shapes, places, units)
        words = f"full mass matrix of {len(inertia.dofs)} dofs"
    else:
        gram, is_exact, words = gram_of_mesh(inertia, shapes, places, units), True, "mesh and density"
    return replace(moments_in_frame(gram, frame), is_exact=is_exact), words


def gram_of_full_mass(
    inertia: FullMass, shapes: Shapes, places: Mapping[int, Array], units: Units
) -> tuple[Array, bool]:
    """Return the Gram matrix ∫ a aᵀ from a full mass matrix, in basic axes, and whether it is exact (M is M_s ⊗ 1)."""
    numbers = np.unique(inertia.dofs[:, 0])
    lost = [int(number) for number in numbers if int(number) not in inertia.places and int(number) not in places]
    if lost:
        raise ForeignBodyError(f"full mass: nodes {lost[:6]} have no position; give their positions")
    index = {int(number): k for k, number in enumerate(numbers)}
    dofs = np.stack([np.array([index[int(number)] for number in inertia.dofs[:, 0]]), inertia.dofs[:, 1]], axis=1)
    nodes = np.array([inertia.places.get(int(number), places.get(int(number))) for number in numbers])
    body = FEBody("full mass", inertia.M, sp.csc_array(inertia.M.shape), nodes, dofs, units=units)
    M_s = scalar_mass_of(body)
    if M_s is None:
        return gram_from_matrices(body, shapes(inertia.dofs)), False
    return ScalarMassModel(body.name, M_s, body.nodes, body.dofs).mass_gram(shapes(inertia.dofs)), True


def gram_of_mesh(inertia: MeshMass, shapes: Shapes, places: Mapping[int, Array], units: Units) -> Array:
    """Return the Gram matrix ∫ a aᵀ from the elements of a mesh, in basic axes."""
    mesh = inertia.mesh
    numbers = mesh.node_numbers if len(mesh.node_numbers) else np.arange(len(mesh.nodes))
    common = [k for k, number in enumerate(numbers) if int(number) in places]
    if common:
        far = np.linalg.norm(mesh.nodes[common] - [places[int(numbers[k])] for k in common], axis=1)
        size = float(np.linalg.norm(np.ptp(mesh.nodes, axis=0)))
        if far.max() > 1e-3 * size:
            at = int(numbers[common[int(np.argmax(far))]])
            raise ForeignBodyError(
                f"mesh {mesh.source}: node {at} is {far.max():.3g} away from its position in the superelement; "
                "expected the mesh from which the superelement was made, in the same units and axes"
            )
    density = inertia.density if isinstance(inertia.density, Mapping) else {"": inertia.density}
    materials = {
        group: Material(group or "given density", E=1.0, nu=0.0, rho=float(rho)) for group, rho in density.items()
    }
    body = solid_body(mesh, materials[""] if "" in materials else materials, name="mesh beside", units=units)
    assert body.element_model is not None
    return body.element_model.mass_gram(shapes(dofs_of(numbers, 3)))


def moments_in_frame(gram: Array, frame: BodyFrame) -> Moments:
    """Return the moments in B from a Gram matrix ∫ a aᵀ in basic axes about their origin: c_B = axesᵀ (c - origin)."""
    n = (len(gram) - 4) // 3
    L = np.zeros((4 + 3 * n, 4 + 3 * n))
    L[0, 0] = 1.0
    L[1:4, 0], L[1:4, 1:4] = -frame.axes.T @ frame.origin, frame.axes.T
    L[4:, 4:] = np.kron(frame.axes.T, np.eye(n))
    return moments_from_gram(L @ gram @ L.T)


def completed(known: Moments, other: Moments, what: str) -> tuple[Moments, str]:
    """Complete moments with terms from another route, and describe differences in terms that both routes give.

    The values from the reduced mass matrix do not change: m, S, R, 1C, 2C, M*.

    Raises
    ------
    ForeignBodyError
        If the two belong to different bodies.
    """
    length = float(np.sqrt(np.trace(known.R) / known.m)) or 1.0
    size = np.sqrt(known.m)
    by_name = {
        "mass": abs(other.m / known.m - 1),
        "first moment": float(np.abs(other.S - known.S).max() / (known.m * length)),
        "second moment": float(np.abs(other.R - known.R).max() / (known.m * length**2)),
        "1C": float(np.abs(other.C1 - known.C1).max(initial=0.0) / size),
        "2C": float(np.abs(other.C2 - known.C2).max(initial=0.0) / (size * length)),
        "modal mass": float(np.abs(other.M - known.M).max(initial=0.0)),
    }
    wrong = [f"{name} differs by {100 * by_name[name]:.3g} %" for name, most in OTHER_BODY.items()
             if not by_name[name] <= most]  # fmt: skip
    if wrong:
        raise ForeignBodyError(
            f"{what}: they do not belong to this body: {', '.join(wrong)} (mass {other.m:.6g}, in the reduced mass "
            f"matrix {known.m:.6g}); check units, missing parts, or whether the model is another one"
        )
    whole = replace(known, missing=())
    P = np.asarray(other.P)
    S_kl = np.asarray(other.S_kl)
    trace = np.einsum("ab,kl->abkl", np.eye(3), other.M) / 3
    parts = {
        "P": whole.P + (P + P.swapaxes(0, 1)) / 2,
        "S_kl": whole.S_kl + S_kl - trace,
    }
    assert known.missing == INERTIA_TERMS
    is_exact = other.is_exact and max(by_name.values()) < EXACT
    return replace(whole, **parts, is_exact=is_exact), ", ".join(f"{key} {x:.1e}" for key, x in by_name.items())

"""Eigenvalues about the equilibrium differentiated, with the change of the equilibrium itself.

Small motions exp(lambda t) of the whole system, wrenches included, obey P(lambda) phi = 0 with

    P = [lambda² M + lambda C + K   -Jᵀ]        dlambda = - (psiᴴ P' phi)/(psiᴴ P_lambda phi)
        [lambda G_v + G_x            V ]

psi, phi the left and right null vectors, P_lambda the derivative by lambda and P' the derivative of the matrices by p
along (x(p), w(p), p), by differences of fourth order. Of an eigenvalue repeated m times psi and phi have m columns, and
the derivatives of its m branches are the eigenvalues of - (psiᴴ P_lambda phi)⁻¹ psiᴴ P' phi.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array
from floatframe.design.gradients.outputs import moved
from floatframe.design.gradients.parameters import Neighbour, Parameter
from floatframe.design.gradients.tangents import Point, PointTangents, tangents_at
from floatframe.engine.open_equations.configuration import Configurations
from floatframe.engine.open_equations.rows import structure_of
from floatframe.errors import ModelError

__all__ = ["Branch", "eigenvalue_derivatives", "pencil_rates"]

NEAR = 1e-6  #: relative distance of eigenvalues that are one
DEFECTIVE = 1e-9  #: |psiᴴ P_lambda phi| by the size of its terms, below which an eigenvalue has no derivative


@dataclass(frozen=True)
class Branch:
    """An eigenvalue and how often it is there."""

    value: complex
    n_times: int
    place: int  #: of this mode among those


def pencil_rates(
    parameter: Parameter, own: Neighbour, group: Configurations, point: Point, column: Array
) -> PointTangents:
    """Return the derivatives of all matrices by a parameter, along the equilibrium that moves by `column`."""
    n = group.n_v
    change = np.concatenate([column[:n], np.zeros(2 * n), column[n:]])
    found = []
    for offset, each in zip(parameter.stencil.offsets, parameter.around, strict=True):
        there = moved(group, own.compiled, point, change, offset * parameter.step)
        found.append(tangents_at(structure_of(each.compiled.model), each.compiled.model, each.work, there))
    names = PointTangents.__dataclass_fields__
    return PointTangents(*(parameter.derivative([getattr(each, name) for each in found]) for name in names))


def pencil(at: PointTangents, value: complex) -> Array:
    """Return P(lambda)."""
    bodies = value**2 * at.M + value * at.C + at.K
    return np.block([[bodies, -at.J.T.astype(complex)], [value * at.G_v + at.G_x, at.V.astype(complex)]])


def pencil_slope(at: PointTangents, value: complex) -> Array:
    """Return the derivative of P by lambda."""
    n_w = len(at.V)
    return np.block(
        [[2 * value * at.M + at.C, np.zeros((len(at.M), n_w))], [at.G_v.astype(complex), np.zeros((n_w, n_w))]]
    )


def branch_of(eigenvalues: Array, k: int) -> Branch:
    """Return mode k (from 0) with those that have the same eigenvalue.

    Raises
    ------
    ModelError
        For a motion that costs nothing: its two eigenvalues of zero have one vector, and no derivative.
    """
    value = complex(eigenvalues[k])
    if value == 0:
        raise ModelError(f"sensitivities: mode {k + 1} costs nothing (eigenvalue zero, twice), and has no derivative")
    same = np.flatnonzero(np.abs(eigenvalues - value) <= NEAR * abs(value))
    return Branch(value, len(same), int(np.flatnonzero(same == k)[0]))


def null_vectors(P: Array, n_times: int) -> tuple[Array, Array]:
    """Return left and right null vectors of P, (n, n_times) each, found on scaled rows and columns."""
    rows, columns = np.ones(len(P)), np.ones(len(P))
    scaled = P.copy()
    for _ in range(5):
        r = 1 / np.sqrt(np.abs(scaled).max(axis=1))
        scaled, rows = r[:, None] * scaled, rows * r
        c = 1 / np.sqrt(np.abs(scaled).max(axis=0))
        scaled, columns = scaled * c, columns * c
    left, _, right = la.svd(scaled)
    return rows[:, None] * left[:, -n_times:], columns[:, None] * right[-n_times:].conj().T


def eigenvalue_derivatives(at: PointTangents, rates: list[PointTangents], branch: Branch) -> Array:
    """Return dlambda/dp of a mode by each parameter, (n_p,) complex; of branches in ascending order of their own.

    Raises
    ------
    ModelError
        If the eigenvalue is defective (as many modes run into one), and has no derivative.
    """
    psi, phi = null_vectors(pencil(at, branch.value), branch.n_times)
    slope = psi.conj().T @ pencil_slope(at, branch.value) @ phi
    size = np.abs(psi.conj().T) @ np.abs(pencil_slope(at, branch.value)) @ np.abs(phi)
    if la.svdvals(slope)[-1] <= DEFECTIVE * size.max():
        raise ModelError(
            f"sensitivities: the eigenvalue {branch.value:.6g} is defective (modes run into one another, as at "
            "critical damping), and has no derivative"
        )
    found = []
    for rate in rates:
        by_p = -np.linalg.solve(slope, psi.conj().T @ pencil(rate, branch.value) @ phi)
        branches = np.linalg.eigvals(by_p) if branch.n_times > 1 else by_p[0]
        found.append(branches[np.lexsort((branches.real, branches.imag))][branch.place])
    return np.array(found)

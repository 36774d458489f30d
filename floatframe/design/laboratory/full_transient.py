"""A linear transient of a complete finite element model by direct integration without reduction.

Index h is for dofs whose motion is given, i for the others. In the axes of the mesh, relative to a frame that may move,

    M_ii u_i'' + D_ii u_i' + K_ii u_i = f_i - (M_ih u_h'' + D_ih u_h' + K_ih u_h)
    f = W p(t) + Σ f_k p_k(t) - M Psi_R (a, alpha) + Σ omega_a omega_b f_ab  (wrenches, load cases, inertia)

(1) generalized-alpha on the vector space (docs/theory.md §9): u_1 = u_p + beta h² a_1, u'_1 = v_p + gamma h a_1,
    u''_1 = c_m a_1 + w, all known but a_1
(2) (c_m M_ii + gamma h D_ii + beta h² K_ii) a_1 = f_i - K_ii u_p - D_ii v_p - M_ii w: one matrix, factorised once
(3) forces that move the given dofs: the rows h of the same equation

The equations are linear in the deformation. They do not contain its coupling with the rotation of the frame (Coriolis,
softening, geometric stiffness), so that omega must be well below the lowest frequency.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.interpolate import make_interp_spline

from cms.assessment.quality.reference.ports import Ports
from cms.body.geometric_stiffness import SPIN_PAIRS
from cms.body.reduced_body import BodyFrame
from cms.errors import FactorizationError
from cms.linear_algebra.solvers.factorization import Factorization, factorize
from cms.reduction.basis.damping import RayleighDamping
from cms.reduction.geometric_stiffness.unit_states import has_geometric_stiffness, unit_mass_loads
from fe_models.body.fe_body import MULTIPLIER, FEBody
from fe_models.body.rigid_motion import MassLoads, rigid_motion_of_dofs
from fe_models.foundation.arrays import Array, GivenArray, IntArray, frozen, given
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from floatframe.errors import ModelError

__all__ = ["FrameAcceleration", "FullTransient", "full_transient"]

MOST_NUMBERS = 2.5e8  #: largest number of results in memory, 2 GB


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class FrameAcceleration:
    """Motion of the frame relative to which the body deforms, as inertia load; components in mesh axes.

    Parameters
    ----------
    acceleration
        Acceleration of `origin` minus the acceleration of free fall, (n_t, 3) [m/s²].
    omega
        Angular velocity, (n_t, 3) [rad/s].
    alpha
        Angular acceleration, (n_t, 3) [rad/s²].
    origin
        Reference point in mesh coordinates, (3,) [m].
    """

    acceleration: GivenArray = given()
    omega: GivenArray = given()
    alpha: GivenArray = given()
    origin: GivenArray = given(np.zeros(3))


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class FullTransient:
    """Motion of the selected rows, and forces at the interfaces with prescribed motion.

    Parameters
    ----------
    t
        Times, (n_t,).
    u
        Selected displacements, (n_t, n_rows).
    u_dot
        Their rates, (n_t, n_rows).
    u_ddot
        Their second rates, (n_t, n_rows).
    forces
        Forces on the dofs of each interface, mesh axes, (n_t, n_dofs) [N, N m].
    n_dof
        Number of integrated dofs.
    """

    t: Array
    u: Array
    u_dot: Array
    u_ddot: Array
    forces: Mapping[str, Array]
    n_dof: int


def full_transient(
    body: FEBody,
    t: Array,
    *,
    motions: Mapping[str, Array | tuple[Array, Array, Array]] | None = None,
    wrenches: Mapping[str, Array] | None = None,
    loads: Mapping[str, Array] | None = None,
    frame: FrameAcceleration | None = None,
    damping: RayleighDamping | None = None,
    rho_inf: float = 0.8,
    rows: sp.sparray | Array | None = None,
    is_preloaded: bool = False,
    every: int = 1,
) -> FullTransient:
    """Integrate the equations of a finite element model over time, from rest.

    Parameters
    ----------
    body
        A coupled body.
    t
        Equally spaced times, (n_t,), in the time unit of the body.
    motions
        Motion of the boundary dofs of each interface (reference node, mesh axes; all dofs of kind "nodes"),
        (n_t, n_dofs), or a tuple with its first and second derivatives, which otherwise come from a quintic spline.
    wrenches
        Force and moment on the reference point of each interface, mesh axes, (n_t, 6).
    loads
        Amplitude of each load case of the body, (n_t,).
    frame
        Motion of the frame relative to which displacements are measured; None: a fixed frame.
    damping
        Damping alpha M + beta K, in addition to the damping of the body.
    rho_inf
        Spectral radius at infinite frequency of generalized-alpha, 0 to 1.
    rows
        Matrix of the results, (n_rows, n_dof), such as `recovery` rows of some nodes; None: every dof.
    is_preloaded
        Start in equilibrium with the loads and motions of the first time, instead of undeformed; the given motions must
        hold the body.
    every
        Results are stored at every `every`-th time, from the first on.

    Raises
    ------
    ModelError
        If times, histories or names do not fit, a load acts on an interface that is moved, or the results are too many.
    CmsError
        If the matrix cannot be factorised.
    """
    where = f"full transient of body {body.name!r}"
    body.require_coupled()
    t = np.asarray(t, dtype=float)
    step = np.diff(t)
    if t.ndim != 1 or len(t) < 2 or not (step > 0).all() or np.ptp(step) > 1e-6 * step.max():
        raise ModelError(f"{where}: t: expected two or more times, ascending and evenly spaced")
    if not 0 <= rho_inf <= 1:
        raise ModelError(f"{where}: rho_inf: expected 0 to 1, got {rho_inf:g}")
    if every < 1:
        raise ModelError(f"{where}: every: expected a whole number from 1, got {every}")
    n_t, h = len(t), float(step.mean())
    n_out = (n_t - 1) // every + 1
    P = sp.eye_array(body.n_dof, format="csr") if rows is None else sp.csr_array(rows)
    if P.shape[1] != body.n_dof:
        raise ModelError(f"{where}: rows: expected {body.n_dof} columns, got {P.shape[1]}")
    if 3.0 * n_out * P.shape[0] > MOST_NUMBERS:
        raise ModelError(
            f"{where}: {P.shape[0]} rows at {n_out} times are {24e-9 * n_out * P.shape[0]:.1f} GB; give rows = a "
            "matrix of selected rows, or every = 10, for example"
        )
    moved = {name: history(where, body, name, given, t) for name, given in (motions or {}).items()}
    held = np.concatenate([boundary_dofs(body, name) for name in moved] or [np.zeros(0, np.int64)])
    u_h, v_h, a_h = (np.hstack([of[k] for of in moved.values()] or [np.zeros((n_t, 0))]) for k in range(3))
    F, p = load_columns(where, body, t, wrenches or {}, loads or {}, set(moved), frame)
    i = np.setdiff1d(np.arange(body.n_dof), held)
    alpha, beta = (0.0, 0.0) if damping is None else (damping.alpha, damping.beta)
    own = sp.csc_array(body.M.shape) if body.D is None else body.D
    M, K = sp.csc_array(body.M), sp.csc_array(body.K)
    D = sp.csc_array(own + alpha * M + beta * without_multipliers(body, K))

    scheme = Scheme.of(rho_inf, h)
    A = scheme.c_m * M + scheme.c_d * D + scheme.c_k * K
    M_h, D_h, K_h = M[:, held], D[:, held], K[:, held]
    M_i, D_i, K_i = M[i][:, i], D[i][:, i], K[i][:, i]
    results = [np.empty((n_out, P.shape[0])) for _ in range(3)]
    reaction = np.zeros((n_out, len(held)))
    rows_h = [sp.csr_array(X[held]) for X in (K, D, M)]

    def known(k: int) -> Array:
        """Return the loads minus the contribution of prescribed motions, over all dofs."""
        return np.asarray(F @ p[k] - M_h @ a_h[k] - D_h @ v_h[k] - K_h @ u_h[k])

    with factorize(sp.csc_array(A[i][:, i]), definite=False) as factor:
        u, v = np.zeros(len(i)), np.zeros(len(i))
        f = known(0)[i]
        if is_preloaded:
            u = equilibrium(where, sp.csc_array(K_i), f)
        acceleration = np.asarray(factor.solve(f - D_i @ v - K_i @ u)) * scheme.c_m
        algorithmic = acceleration.copy()
        for k in range(n_t):
            if k:
                u_p, v_p, w = scheme.predicted(u, v, algorithmic, acceleration)  # (1)
                new = factor.solve(known(k)[i] - K_i @ u_p - D_i @ v_p - M_i @ w)  # (2)
                u, v = u_p + scheme.c_k * new, v_p + scheme.c_d * new
                acceleration, algorithmic = scheme.c_m * new + w, new
            if k % every:
                continue
            whole = [np.zeros(body.n_dof) for _ in range(3)]
            for x, at_i, at_h in zip(whole, (u, v, acceleration), (u_h[k], v_h[k], a_h[k]), strict=True):
                x[i], x[held] = at_i, at_h
            for result, x in zip(results, whole, strict=True):
                result[k // every] = P @ x
            if len(held):  # (3)
                reaction[k // every] = sum(X @ x for X, x in zip(rows_h, whole, strict=True)) - (F @ p[k])[held]
    ends = np.cumsum([0, *(len(boundary_dofs(body, name)) for name in moved)])
    forces = {name: reaction[:, a:b] for name, a, b in zip(moved, ends[:-1], ends[1:], strict=True)}
    return FullTransient(t[::every], results[0], results[1], results[2], forces, len(i))


@dataclass(frozen=True)
class Scheme:
    """Coefficients of generalized-alpha for one step."""

    h: float
    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float

    @classmethod
    def of(cls, rho_inf: float, h: float) -> "Scheme":
        """Return the coefficients for a spectral radius at infinity and a step."""
        alpha_f, alpha_m = rho_inf / (rho_inf + 1), (2 * rho_inf - 1) / (rho_inf + 1)
        gamma = 0.5 + alpha_f - alpha_m
        return cls(h, alpha_m, alpha_f, (gamma + 0.5) ** 2 / 4, gamma)

    @property
    def c_m(self) -> float:
        """Derivative of the new acceleration by the new algorithmic acceleration."""
        return (1 - self.alpha_m) / (1 - self.alpha_f)

    @property
    def c_d(self) -> float:
        """Derivative of the new velocity by the new algorithmic acceleration."""
        return self.gamma * self.h

    @property
    def c_k(self) -> float:
        """Derivative of the new displacement by the new algorithmic acceleration."""
        return self.beta * self.h**2

    def predicted(self, u: Array, v: Array, algorithmic: Array, acceleration: Array) -> tuple[Array, Array, Array]:
        """Return the known parts of displacement, velocity and acceleration after a step."""
        h = self.h
        return (
            u + h * v + h**2 * (0.5 - self.beta) * algorithmic,
            v + h * (1 - self.gamma) * algorithmic,
            (self.alpha_m * algorithmic - self.alpha_f * acceleration) / (1 - self.alpha_f),
        )


def boundary_dofs(body: FEBody, name: str) -> IntArray:
    """Return the boundary dofs of an interface."""
    dofs = body.interface(name).dofs
    assert dofs is not None
    return dofs


def history(
    where: str, body: FEBody, name: str, given: "Array | tuple[Array, Array, Array]", t: Array
) -> tuple[Array, Array, Array]:
    """Return the motion of an interface with its rates, (n_t, n_dofs) each."""
    wanted = (len(t), len(boundary_dofs(body, name)))
    parts = [np.asarray(part, dtype=float) for part in (given if isinstance(given, tuple) else (given,))]
    if len(parts) not in (1, 3) or any(part.shape != wanted or not np.isfinite(part).all() for part in parts):
        got = ", ".join(str(part.shape) for part in parts)
        raise ModelError(f"{where}: motion of {name!r}: expected {wanted}, finite, or three of them; got {got}")
    if len(parts) == 1:
        spline = make_interp_spline(t, parts[0], k=min(5, 2 * ((len(t) - 2) // 2) + 1))
        parts += [spline(t, nu=1), spline(t, nu=2)]
    return parts[0], parts[1], parts[2]


def load_columns(
    where: str,
    body: FEBody,
    t: Array,
    wrenches: Mapping[str, Array],
    loads: Mapping[str, Array],
    moved: set[str],
    frame: FrameAcceleration | None,
) -> tuple[Array, Array]:
    """Return columns of load over the dofs, (n_dof, k), and their amplitudes, (n_t, k)."""
    columns, amplitudes = [np.zeros((body.n_dof, 0))], [np.zeros((len(t), 0))]
    both = sorted(moved & set(wrenches))
    if both:
        raise ModelError(
            f"{where}: {', '.join(both)}: expected a motion or a wrench, got both; each follows from the other"
        )
    if wrenches:
        columns.append(Ports.of_body(body, tuple(wrenches)).loads())
    cases = {case.name: case.f for case in body.load_cases}
    unknown = [name for name in loads if name not in cases]
    if unknown:
        raise ModelError(f"{where}: no load case {', '.join(unknown)}; it has {', '.join(cases) or 'none'}")
    columns += [np.asarray(cases[name])[:, None] for name in loads]
    for name, table, width in (*((n, g, 6) for n, g in wrenches.items()), *((n, g, 1) for n, g in loads.items())):
        values = np.asarray(table, dtype=float).reshape(len(table), -1)
        if values.shape != (len(t), width) or not np.isfinite(values).all():
            raise ModelError(f"{where}: load {name!r}: expected {(len(t), width)}, finite, got {values.shape}")
        amplitudes.append(values)
    if frame is not None:
        for key in ("acceleration", "omega", "alpha"):
            if np.shape(getattr(frame, key)) != (len(t), 3):
                raise ModelError(f"{where}: frame: {key}: expected {(len(t), 3)}, got {np.shape(getattr(frame, key))}")
        columns.append(
            -np.asarray(body.M @ rigid_motion_of_dofs(body.nodes, body.dofs, np.asarray(frame.origin, float)))
        )
        amplitudes.append(np.hstack([frame.acceleration, frame.alpha]))
        columns.append(spin_columns(body, np.asarray(frame.origin, dtype=float)))
        omega = np.asarray(frame.omega, dtype=float)
        amplitudes.append(np.stack([(1 if a == b else 2) * omega[:, a] * omega[:, b] for a, b in SPIN_PAIRS], axis=1))
    return frozen(np.hstack(columns)), frozen(np.hstack(amplitudes))


def spin_columns(body: FEBody, origin: Array) -> Array:
    """Return the loads for the products `SPIN_PAIRS` of angular velocities about a point, (n_dof, 6)."""
    unit = unit_mass_loads(BodyFrame("", origin))
    spin = MassLoads(unit.A[6:], unit.b[6:])
    if body.element_model is not None and has_geometric_stiffness(body):
        on_mesh = body.element_model.mass_forces(spin)
        return np.asarray(on_mesh if body.recovery is None else body.recovery.matrix.T @ on_mesh)
    at_nodes, at_dofs = (
        spin.at(body.nodes),
        np.zeros((body.n_dof, spin.k)),
    )  # model of matrices alone: the field at the nodes
    node, component = body.dofs.T
    is_translation = (component >= 0) & (component < 3)
    at_dofs[is_translation] = at_nodes[node[is_translation], component[is_translation]]
    return np.asarray(body.M @ at_dofs)


def without_multipliers(body: FEBody, K: sp.csc_array) -> sp.csc_array:
    """Return K without the rows and columns of multipliers, which have no stiffness."""
    keep = sp.diags_array((body.dofs[:, 1] != MULTIPLIER).astype(float))
    return sp.csc_array(keep @ K @ keep)


def equilibrium(where: str, K_i: sp.csc_array, f: Array) -> Array:
    """Return K_i⁻¹ f; `ModelError` if the prescribed motions do not hold the body."""
    try:
        factor: Factorization = factorize(K_i, definite=False)
    except FactorizationError as error:
        raise ModelError(
            f"{where}: is_preloaded: the interfaces whose motion is given do not hold the body ({error}); give the "
            "motion of more interfaces, or begin undeformed"
        ) from error
    with factor:
        return np.asarray(factor.solve(f))

"""Schemes that conserve energy and momentum in steps of any size, or let energy only decrease.

Evaluated in `floatframe.engine.structure_preserving.kernels.steps`.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.structure_preserving.bodies import BodyStep, CentralBody, Placed, moved, step_of
from floatframe.engine.structure_preserving.compiled import Filter, filter_of
from floatframe.engine.structure_preserving.constraints import Span
from floatframe.engine.structure_preserving.kernels.records import CONSERVING
from floatframe.engine.structure_preserving.newton import remembered, solve_step, work_of
from floatframe.engine.structure_preserving.system import DiscreteSystem
from floatframe.errors import ModelError
from floatframe.integrators.discrete_run import DiscreteScheme, StepResult, check_options
from floatframe.model.rotations import cross, turned

__all__ = ["EnergyDecaying", "EnergyMomentum"]


@dataclass(frozen=True)
class EnergyMomentum(DiscreteScheme):
    """Energy, linear and angular momentum to the tolerance of Newton's method, second order [1]_ [2]_ [3]_.

    In coordinates of the centre of mass (discrete/bodies.py), ' at the end of a step, mean values overlined in words:

    (1) c' - c = h mean(v),  R' = R cay(h mean(omega)),  q' - q = h mean(q_dot)
    (2) m (v' - v) = h F
    (3) R' Pi' - R Pi = h tau                                            about the centre of mass, ground axes
    (4) Y' - Y = h (1/2 wᵀ M,k(mean q) w' - K mean(q) - D mean(q_dot) + Q)
    (5) g(t') = 0

    F, tau, Q act at the mean lever with the discrete derivatives of discrete/markers.py, so that their work is that of
    the true displacements. T' - T is mean(v)·(2) + mean(omega)·(3) + mean(q_dot)·(4), because M is of degree two in q:
    energy changes by the work of forces alone, closed joints do none. Torques of internal forces cancel, since levers
    are those to the mean of the true positions. Derivation in docs/integrators.md.

    Velocities fulfil joints in the mean over a step, at its ends to second order; accelerations and reactions in the
    results are those of the equations of motion at the output times, for velocities that fulfil the joints.

    References
    ----------
    .. [1] Simo & Wong (1991), International Journal for Numerical Methods in Engineering 31, 19-52: the rigid body.
    .. [2] Gonzalez (1996), Journal of Nonlinear Science 6, 449-467: discrete derivatives.
    .. [3] Betsch & Steinmann (2001), International Journal for Numerical Methods in Engineering 50, 1931-1955:
       constraints.
    """

    tolerance: float = 1e-11  #: largest last correction over the increments of the step
    max_iterations: int = 25

    def __post_init__(self) -> None:
        check_options(self)

    @property
    def equations(self) -> int:
        """Kind of equations: `CONSERVING`."""
        return CONSERVING

    def one_step(self, ds: DiscreteSystem, placed: list[Placed], span: Span, f: Array) -> StepResult:
        """Return the bodies, multipliers and work after a step."""
        return conserving_step(ds, placed, span, f, 1.0, self.tolerance, self.max_iterations)


@dataclass(frozen=True)
class EnergyDecaying(DiscreteScheme):
    """The scheme of `EnergyMomentum` with dissipation in unresolved modes: energy never increases.

    In place of (1) and (4), with E = J⁻¹ B and M_e = M - Bᵀ E at q = 0, the modes Phi of (K, M_e), their frequencies
    omega, and Z = Y - Eᵀ Pi, the momentum of vibrations, which is zero in all rigid motions whatever the frame,

        R' = R cay(h (mean(omega) - E y)),   q' - q = h (mean(q_dot) + y),   y = F (Z* - Z),
        K mean(q) becomes K (mean(q) + X (q' - q)),   X = Phi chi Phiᵀ M_e,   F = Phi chi/(1 + 2 chi) Phiᵀ,
        chi = chi_inf x²/(1 + x²),   x = omega h,   chi_inf = (1 - rho)/(1 + rho)/2

    Z* is Z' for the velocities that y = 0 would give, so that y = Phi chi Phiᵀ (Z' - Z) where deformations are small.
    Energy falls in a step by (q' - q)ᵀ K X (q' - q) + yᵀ (Z' - Z), whatever h, since chi is at most 1/2; momenta stay
    exact. A mode alone has the spectral radius of the method with theta = 1/2 + chi, rho_inf where h is long; for short
    h dissipation is of third order, the scheme of second. The idea of dissipating stress and velocity together is that
    of Armero & Romero (2001) [1]_; the filter by frequency, which makes it of second order, is possible because K is
    constant here.

    References
    ----------
    .. [1] Computer Methods in Applied Mechanics and Engineering 190, 2603-2649.
    """

    rho_inf: float = 0.5  #: spectral radius of modes far above 1/h, 0 <= rho_inf <= 1; 1: `EnergyMomentum`
    tolerance: float = 1e-11  #: largest last correction over the increments of the step
    max_iterations: int = 25

    def __post_init__(self) -> None:
        check_options(self)
        if not 0.0 <= self.rho_inf <= 1.0:
            raise ModelError(f"EnergyDecaying: rho_inf: expected 0 <= rho_inf <= 1, got {self.rho_inf}")

    @property
    def equations(self) -> int:
        """Kind of equations: `CONSERVING`."""
        return CONSERVING

    @property
    def damping(self) -> float:
        """Spectral radius of modes far above 1/h."""
        return self.rho_inf

    def one_step(self, ds: DiscreteSystem, placed: list[Placed], span: Span, f: Array) -> StepResult:
        """Return the bodies, multipliers and work after a step."""
        return conserving_step(ds, placed, span, f, self.rho_inf, self.tolerance, self.max_iterations)


@dataclass(frozen=True, eq=False)
class ConservingScheme:
    """Equations (1) to (4) of one body, as `discrete.newton.Scheme`; `filters` for bodies with dissipation."""

    filters: dict[int, Filter]
    acts_along: bool = True

    def rates(self, body: CentralBody, place: Placed, x: Array, h: float) -> tuple[Array, Array]:
        """(1): return omega and q_dot at the end of a step, for stacks of increments."""
        theta, dq = x[..., 3:6], x[..., 6:]
        omega = 2 * theta / h - place.omega
        q_dot: Array = 2 * dq / h - place.q_dot
        made = self.filters.get(id(body))
        if made is not None:
            Pi_0, Y_0 = body.momenta(place.q, place.omega, place.q_dot)
            Pi_1, Y_1 = body.momenta(place.q + dq, omega, q_dot)
            rate = ((Y_1 - Y_0) - (Pi_1 - Pi_0) @ made.E) @ made.F.T
            omega, q_dot = omega + 2 * rate @ made.E.T, q_dot - 2 * rate
        return omega, q_dot

    def inertia(self, body: CentralBody, place: Placed, x: Array, h: float) -> Array:
        """h/2 times the left sides of (2) to (4) without loads."""
        d, theta, dq = x[..., :3], x[..., 3:6], x[..., 6:]
        omega, q_dot = self.rates(body, place, x, h)
        Pi_0, Y_0 = body.momenta(place.q, place.omega, place.q_dot)
        Pi_1, Y_1 = body.momenta(place.q + dq, omega, q_dot)
        turning = Pi_1 + 0.5 * cross(theta, Pi_1) - Pi_0 + 0.5 * cross(theta, np.broadcast_to(Pi_0, theta.shape))
        parts = [body.m * (d - h * place.v), 0.5 * h * turning]
        q_mean = place.q + 0.5 * dq
        w_0 = (np.broadcast_to(place.omega, theta.shape), np.broadcast_to(place.q_dot, dq.shape))
        force = body.inertia_force(place.q, place.q + dq, w_0, (omega, q_dot)) - dq @ body.D.T / h
        made = self.filters.get(id(body))
        force = force - (q_mean if made is None else q_mean + dq @ made.X.T) @ body.K.T
        parts.append(0.5 * h * (Y_1 - Y_0) - 0.5 * h**2 * force)
        return np.concatenate(parts, axis=-1)

    def force_step(self, place: Placed, x: Array) -> BodyStep:
        """Forces act along the step."""
        return step_of(place, x)

    def torque(self, place: Placed, x: Array, tau: Array) -> Array:
        """(1 - tilde(theta)/2) R_0ᵀ tau: (3) times (1 - tilde(theta)/2) R_0ᵀ, which makes it polynomial."""
        tau = turned(place.R.T, tau)
        return tau - 0.5 * cross(x[..., 3:6], tau)


def conserving_step(
    ds: DiscreteSystem,
    placed: list[Placed],
    span: Span,
    f: Array,
    rho_inf: float,
    tolerance: float,
    max_iterations: int,
) -> StepResult:
    """Return the bodies, multipliers and work after a step of the conserving or decaying scheme."""
    h = span.h
    filters = {}
    if rho_inf < 1.0:
        filters = {id(body): filter_of(body, h, rho_inf) for body in set(ds.bodies) if body.n}
    scheme = ConservingScheme(filters)
    solution = solve_step(ds, scheme, placed, span, f, tolerance, max_iterations)
    after = []
    for body, place, x in zip(ds.bodies, placed, solution.x, strict=True):
        omega, q_dot = scheme.rates(body, place, x, h)
        after.append(moved(place, x, 2 * x[:3] / h - place.v, omega, q_dot))
    work, w = work_of(ds, scheme, placed, span, solution), remembered(ds, placed, span, solution)
    return StepResult(after, solution.f, work, solution.n_iterations, w)

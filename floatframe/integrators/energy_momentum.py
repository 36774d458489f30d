"""Schemes that conserve energy and momentum for steps of any size, or never increase the energy.

Evaluated in `floatframe.engine.structure_preserving.kernels.steps`.
"""

from dataclasses import dataclass

from fe_models.foundation.records import checked_fields
from floatframe.engine.structure_preserving.kernels.records import CONSERVING
from floatframe.errors import ModelError
from floatframe.integrators.discrete_run import DiscreteScheme, check_options

__all__ = ["EnergyDecaying", "EnergyMomentum"]


@dataclass(frozen=True)
@checked_fields(ModelError)
class EnergyMomentum(DiscreteScheme):
    """Second-order scheme that conserves energy and momenta to the tolerance of Newton's method [1]_ [2]_ [3]_.

    In coordinates of the centre of mass (`structure_preserving.kernels.bodies`); a prime marks values at the end of a
    step, mean(...) is the mean of both ends:

    (1) c' - c = h mean(v),  R' = R cay(h mean(omega)),  q' - q = h mean(q_dot)
    (2) m (v' - v) = h F
    (3) R' Pi' - R Pi = h tau                                            about the centre of mass, ground axes
    (4) Y' - Y = h (1/2 wᵀ M,k(mean q) w' - K mean(q) - D mean(q_dot) + Q)
    (5) g(t') = 0

    F, tau, Q act at the mean lever with the discrete derivatives of kernels/markers.py, so that they do the work of
    the true displacements. T' - T is mean(v)·(2) + mean(omega)·(3) + mean(q_dot)·(4), because M is of degree two in q:
    energy changes by the work of forces alone, and closed joints do no work. Torques of internal forces cancel, because
    their levers end at the mean of the true positions (docs/theory.md §9).

    The mean velocities of a step fulfil the joints exactly, the velocities at its ends to second order. Accelerations
    and reactions in the results follow from the equations of motion at the output times, for velocities that fulfil
    the joints.

    Parameters
    ----------
    tolerance
        Largest last correction relative to the increments of the step.
    max_iterations
        Largest number of Newton iterations in a step.

    References
    ----------
    .. [1] Simo & Wong (1991), International Journal for Numerical Methods in Engineering 31, 19-52: the rigid body.
    .. [2] Gonzalez (1996), Journal of Nonlinear Science 6, 449-467: discrete derivatives.
    .. [3] Betsch & Steinmann (2001), International Journal for Numerical Methods in Engineering 50, 1931-1955:
       constraints.
    """

    tolerance: float = 1e-11
    max_iterations: int = 25

    def __post_init__(self) -> None:
        check_options(self)

    @property
    def equations(self) -> int:
        """Kind of scheme: `CONSERVING`."""
        return CONSERVING


@dataclass(frozen=True)
@checked_fields(ModelError)
class EnergyDecaying(DiscreteScheme):
    """The scheme of `EnergyMomentum` with dissipation in unresolved modes: energy never increases.

    Let E = J⁻¹ B and M_e = M - Bᵀ E at q = 0, Phi the modes of (K, M_e), omega their frequencies, and Z = Y - Eᵀ Pi the
    momentum of vibrations, which is zero in every rigid motion, in any body frame. (1) and (4) are replaced by

        R' = R cay(h (mean(omega) - E y)),   q' - q = h (mean(q_dot) + y),   y = F (Z* - Z),
        K mean(q) becomes K (mean(q) + X (q' - q)),   X = Phi chi Phiᵀ M_e,   F = Phi chi/(1 + 2 chi) Phiᵀ,
        chi = chi_inf x²/(1 + x²),   x = omega h,   chi_inf = (1 - rho)/(1 + rho)/2

    Z* is Z' for the velocities that y = 0 would give, so that y = Phi chi Phiᵀ (Z' - Z) where deformations are small.
    In a step, energy falls by (q' - q)ᵀ K X (q' - q) + yᵀ (Z' - Z) for any h, because chi is at most 1/2; momenta stay
    exact. A single mode has the spectral radius of the method with theta = 1/2 + chi, which is rho_inf for long h. For
    short h the dissipation is of third order and the scheme of second. Armero & Romero (2001) [1]_ proposed to
    dissipate stress and velocity together. The filter by frequency, which makes the scheme of second order, is possible
    because K is constant here.

    Parameters
    ----------
    rho_inf
        Spectral radius of modes with frequencies far above 1/h, 0 <= rho_inf <= 1; 1 gives `EnergyMomentum`.
    tolerance
        Largest last correction relative to the increments of the step.
    max_iterations
        Largest number of Newton iterations in a step.

    References
    ----------
    .. [1] Computer Methods in Applied Mechanics and Engineering 190, 2603-2649.
    """

    rho_inf: float = 0.5
    tolerance: float = 1e-11
    max_iterations: int = 25

    def __post_init__(self) -> None:
        check_options(self)
        if not 0.0 <= self.rho_inf <= 1.0:
            raise ModelError(f"EnergyDecaying: rho_inf: expected 0 <= rho_inf <= 1, got {self.rho_inf}")

    @property
    def equations(self) -> int:
        """Kind of scheme: `CONSERVING`."""
        return CONSERVING

    @property
    def damping(self) -> float:
        """Spectral radius for modes with frequencies far above 1/h."""
        return self.rho_inf

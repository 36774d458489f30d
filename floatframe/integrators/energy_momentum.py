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

    In coordinates of the centre of mass (`structure_preserving.kernels.bodies`), with ' at the end of a step and
    mean(...) for mean values over it:

    (1) c' - c = h mean(v),  R' = R cay(h mean(omega)),  q' - q = h mean(q_dot)
    (2) m (v' - v) = h F
    (3) R' Pi' - R Pi = h tau                                            about the centre of mass, ground axes
    (4) Y' - Y = h (1/2 wᵀ M,k(mean q) w' - K mean(q) - D mean(q_dot) + Q)
    (5) g(t') = 0

    F, tau, Q act at the mean lever with the discrete derivatives of kernels/markers.py, so that their work is that of
    the true displacements. T' - T is mean(v)·(2) + mean(omega)·(3) + mean(q_dot)·(4), because M is of degree two in q:
    energy changes by the work of forces alone, closed joints do none. Torques of internal forces cancel, since levers
    are those to the mean of the true positions. Derivation in docs/integrators.md.

    Velocities fulfil joints in the mean over a step, at its ends to second order; accelerations and reactions in the
    results are those of the equations of motion at the output times, for velocities that fulfil the joints.

    Parameters
    ----------
    tolerance
        Largest last correction over the increments of the step.
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

    Parameters
    ----------
    rho_inf
        Spectral radius of modes far above 1/h, 0 <= rho_inf <= 1; 1: `EnergyMomentum`.
    tolerance
        Largest last correction over the increments of the step.
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

"""A variational integrator, whose motion makes the sum of discrete Lagrangians stationary.

Evaluated in `floatframe.engine.structure_preserving.kernels.steps`.
"""

from dataclasses import dataclass

from fe_models.foundation.records import checked_fields
from floatframe.engine.kernels.memory import Memory
from floatframe.engine.structure_preserving.kernels.records import VARIATIONAL
from floatframe.errors import ModelError
from floatframe.integrators.discrete_run import DiscreteScheme, check_options
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["Variational"]


@dataclass(frozen=True)
@checked_fields(ModelError)
class Variational(DiscreteScheme):
    """Symplectic scheme of order two: exact momenta, bounded energy error, joints closed in positions and velocities.

    The coordinates are the centre of mass c, R_GB and q (`structure_preserving.kernels.bodies`). Between two
    configurations with R' = R cay(theta), the discrete Lagrangian takes q by the midpoint rule and the potential V of
    gravity and springs by the trapezoidal rule:

        L_d = h (m |d/h|²/2 + T(theta/h, dq/h; mean q) - mean(q)ᵀ K mean(q)/2) - h (V + V')/2
        d = c' - c,  dq = q' - q,  Pi = J omega + B q_dot and Y = Bᵀ omega + M q_dot at theta/h, dq/h, mean q

    (1) m v + h/2 F = m d/h,   Pi_0 + h/2 Rᵀ tau = (1 + tilde(theta)/2 + theta thetaᵀ/4) Pi
        Y_0 + h/2 Q = Y - h/2 (1/2 wᵀ M,k w - K mean(q) - D dq/h),   g(t') = 0
    (2) the same at the end, Pi_0' = (1 - tilde(theta)/2 + theta thetaᵀ/4) Pi + h/2 R'ᵀ tau', ... with G u' = -g_t

    The results contain the momenta with index 0 and the velocities that follow from them. The joints act like forces at
    both ends, with one multiplier that closes positions and one that closes velocities (RATTLE). [1]_ derives the
    discrete Euler-Poincare equations with the Cayley map, [2]_ the constraints. Dampers enter by the discrete
    Lagrange-d'Alembert principle. The implicit midpoint rule integrates the modal stiffness, so that stiff modes do not
    limit h; stiff spring-dampers do.

    Friction by the normal force of a joint is refused.

    Parameters
    ----------
    tolerance
        Largest last correction relative to the increments of the step.
    max_iterations
        Largest number of Newton iterations in a step.

    References
    ----------
    .. [1] Bou-Rabee & Marsden (2009), Foundations of Computational Mathematics 9, 197-219.
    .. [2] Leyendecker, Marsden & Ortiz (2008), Journal of Applied Mathematics and Mechanics (ZAMM) 88, 677-708.
    """

    tolerance: float = 1e-11
    max_iterations: int = 25

    def __post_init__(self) -> None:
        check_options(self)

    def start(self, system: System, t: float, state: State | None = None, before: Memory | None = None) -> Memory:
        """Return the memory at the start, for a consistent state near the given one."""
        for force in system.forces:
            if getattr(force, "friction_coefficient", 0.0) > 0:
                raise ModelError(
                    f"Variational: force {getattr(force, 'name', '')!r} has friction by the normal force, which this "
                    "scheme does not support; use energy-momentum or generalized-alpha"
                )
        return super().start(system, t, state, before)

    @property
    def equations(self) -> int:
        """Kind of scheme: `VARIATIONAL`."""
        return VARIATIONAL

"""Integrators by name and by class, and what each can do."""

from collections.abc import Callable

from fe_models.foundation.words import nearest
from floatframe.errors import ModelError
from floatframe.integrators.energy_momentum import EnergyDecaying, EnergyMomentum
from floatframe.integrators.generalized_alpha import GeneralizedAlpha, hht, newmark, trapezoidal
from floatframe.integrators.ida import Ida
from floatframe.integrators.integrator import Integrator
from floatframe.integrators.relative import RelativeGeneralizedAlpha
from floatframe.integrators.relative_ode import RelativeOde
from floatframe.integrators.variational import Variational

__all__ = ["CLASSES", "INTEGRATORS", "has_fixed_steps", "has_second_order", "made_integrator"]

#: integrators by their names in a system file
INTEGRATORS: dict[str, Callable[..., Integrator]] = {
    "generalized-alpha": GeneralizedAlpha,
    "hht": hht,
    "newmark": newmark,
    "trapezoidal": trapezoidal,
    "energy-momentum": EnergyMomentum,
    "energy-decaying": EnergyDecaying,
    "variational": Variational,
    "ida": Ida,
}

#: classes of the integrators by their names in a results file
CLASSES = {
    cls.__name__: cls
    for cls in (
        GeneralizedAlpha, RelativeGeneralizedAlpha, RelativeOde, EnergyMomentum, EnergyDecaying, Variational, Ida,
    )
}  # fmt: skip


def made_integrator(chosen: Integrator | type[Integrator] | str) -> Integrator:
    """Return an integrator; a class, or its name in a system file, gives one with default parameters.

    Raises
    ------
    ModelError
        If the name is unknown, or the class is not an integrator.
    """
    if isinstance(chosen, str):
        if chosen not in INTEGRATORS:
            raise ModelError(f"integrator: unknown {chosen!r}{nearest(chosen, INTEGRATORS)}")
        return INTEGRATORS[chosen]()
    if not isinstance(chosen, type):
        return chosen
    if Integrator not in chosen.__mro__:
        raise ModelError(f"integrator: expected an integrator, got the class {chosen.__name__}")
    return chosen()


def has_second_order(integrator: Integrator) -> bool:
    """Whether the error of a method is proportional to the square of its step size."""
    return not isinstance(integrator, Ida | RelativeOde)


def has_fixed_steps(integrator: Integrator) -> bool:
    """Whether a method takes steps of the given size rather than choosing its own."""
    return has_second_order(integrator) and getattr(integrator, "error_tolerance", None) is None

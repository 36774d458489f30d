"""Gradients: derivatives of motions, equilibria and vibration modes by parameters, direct and adjoint."""

from floatframe.design.gradients.sensitivities import Sensitivities, sensitivities

__all__ = ["Sensitivities", "sensitivities"]

"""Integrators: one file each; frozen, with `start` and `step` and all memory in a carry; `integrate` owns the loop."""

from floatframe.integrators.generalized_alpha import GeneralizedAlpha

__all__ = ["INTEGRATORS", "GeneralizedAlpha"]

INTEGRATORS = {"generalized-alpha": GeneralizedAlpha}

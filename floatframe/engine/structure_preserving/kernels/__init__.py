"""Compiled steps of the conserving, decaying and variational schemes, one module for each part of the formulas."""

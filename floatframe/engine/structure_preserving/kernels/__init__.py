"""Compiled steps of the conserving, decaying and variational schemes: a module for each part, with its formulas."""

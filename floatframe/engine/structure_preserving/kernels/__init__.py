"""Compiled steps of the conserving, decaying and variational schemes; formulas as in the parent package."""

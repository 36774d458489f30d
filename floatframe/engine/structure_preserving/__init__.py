"""Conserving, decaying and variational schemes: constants of systems, and the compiled steps in `kernels`."""

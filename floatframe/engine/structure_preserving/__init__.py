"""Conserving, decaying and variational schemes: system constants, and compiled steps in `kernels`."""

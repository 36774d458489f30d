"""Compilation of kernels: the decorators, the lean pipeline with its passes and lowering, and plain numba."""

"""How kernels are compiled: the decorators, the lean pipeline with its passes and lowering, plain numba instead."""

"""How kernels are compiled: the lean pipeline, its passes and its lowering."""

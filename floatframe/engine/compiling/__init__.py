"""From the description of a system to the arrays of the kernels."""

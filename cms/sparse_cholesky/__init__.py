"""Sparse Cholesky factorisation of our own, by fronts: where there is no MKL, and where the factor belongs on disk."""

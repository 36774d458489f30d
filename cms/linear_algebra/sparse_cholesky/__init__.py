"""Our multifrontal sparse Cholesky factorisation, for machines without MKL and for factors on disk."""

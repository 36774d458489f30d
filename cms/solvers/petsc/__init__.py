"""Factorisation and modes by PETSc, SLEPc and MUMPS, alone or on many ranks."""

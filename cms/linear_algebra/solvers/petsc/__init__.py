"""Factorisation and modes with PETSc, SLEPc and MUMPS, on one rank or several."""

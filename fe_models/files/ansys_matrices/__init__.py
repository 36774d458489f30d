"""Matrices and superelements of ANSYS: binary .full and .sub files."""

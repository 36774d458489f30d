"""Families of modes of one body, all from one factorisation of its interior stiffness."""

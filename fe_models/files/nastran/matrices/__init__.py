"""Matrices and superelements of Nastran: OP4, DMIG and OP2 files, external superelements; OP4 and DMIG written too."""

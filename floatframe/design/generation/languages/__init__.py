"""Output of routines as code, with one module for each language."""

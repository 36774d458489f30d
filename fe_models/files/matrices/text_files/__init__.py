"""Matrices as text: triplets, lines with node numbers, triangles of user elements, Matrix Market."""

"""Meshes as data: solids, shells, lines; their boundary, selections, and the cut into parts."""

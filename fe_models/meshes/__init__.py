"""Meshes as data: solids, shells and lines, their boundary, selections of nodes, and the cut into parts."""

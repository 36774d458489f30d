"""Meshes of other Python libraries, taken as objects: meshio, pyvista, scikit-fem."""

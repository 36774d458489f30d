"""Mesh objects of other Python libraries: meshio, pyvista, scikit-fem."""

"""Cells of meshes from files and other libraries: node orders, and cells by shape."""

"""Cells of foreign meshes: node orders, cells by shape, and one mesh as a file or an object gives it."""

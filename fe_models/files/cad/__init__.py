"""Geometry from CAD files by gmsh: units, faces and how they are chosen, and the mesh of the body."""

"""Small motions about a steady motion: linearised markers, coordinates and wrenches, and sensor outputs."""

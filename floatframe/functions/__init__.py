"""Functions of time and of coordinates, as tables, pieces and expressions."""

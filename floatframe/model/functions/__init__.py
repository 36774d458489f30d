"""Functions of time and of coordinates: tables, piecewise functions and expressions."""

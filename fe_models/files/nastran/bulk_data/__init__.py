"""Nastran's bulk data as a format: cards and their fields, coordinate systems, grid points."""

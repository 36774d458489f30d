"""Reduced bodies as functions of design parameters, interpolated between samples."""

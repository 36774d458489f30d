"""Solid bodies: elements, assembly, stress, geometric stiffness, interfaces on their faces."""

"""Solid bodies: elements, assembly, stress, geometric stiffness, and interfaces on their faces."""

"""Straight three-dimensional Timoshenko beams: sections, elements, bodies (THEORY §5, docs/beams.md)."""

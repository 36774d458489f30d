"""Straight three-dimensional Timoshenko beams: sections, elements, bodies (docs/theory.md §5, docs/beams.md)."""

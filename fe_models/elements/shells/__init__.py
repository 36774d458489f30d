"""Flat Reissner-Mindlin shells of three and four nodes: elements, properties, bodies (docs/shells.md)."""

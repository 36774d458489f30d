"""Substructures of one large body: nested dissection, parts and separators reduced by themselves (docs/theory.md §2)."""

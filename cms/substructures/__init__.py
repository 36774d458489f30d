"""Substructures of one large body: nested dissection, each part reduced by itself (docs/theory.md §2)."""

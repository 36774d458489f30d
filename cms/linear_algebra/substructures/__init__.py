"""Substructures of one large body: nested dissection, with each part reduced separately (docs/theory.md §2)."""

"""Component mode synthesis: from a finite element body to a small, exact, portable modal file."""

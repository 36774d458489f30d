"""The document that a reduced body is accepted with: every check, its origin, and what it is good for."""

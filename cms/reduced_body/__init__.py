"""The reduced body, and what it holds: invariants, geometric stiffness, stress, labels."""

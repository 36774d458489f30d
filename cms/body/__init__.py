"""The reduced body and its data: invariants, geometric stiffness, stress, labels."""

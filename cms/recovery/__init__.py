"""Recovery matrices: rows for motions, stresses, element forces and interface forces of a reduced body, and files."""

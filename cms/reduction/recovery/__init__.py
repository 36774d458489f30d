"""Recovery matrices: rows for motions, stress, element forces and interface forces of a reduced body; files."""

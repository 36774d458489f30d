"""Element results as linear functions of the displacements: section forces, resultants, strains."""

"""What elements carry in a displacement field, as rows that are linear in it: section forces, resultants, strains."""

"""Linear algebra of reduction: factorisations, eigensolvers, block products, and the memory that they take."""

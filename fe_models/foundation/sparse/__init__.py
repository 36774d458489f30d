"""Large sparse matrices: blocks of them, products in threads, and the order of their rows."""

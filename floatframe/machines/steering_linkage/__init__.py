"""A six-bar steering linkage and its designs, as files."""

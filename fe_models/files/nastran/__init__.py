"""Files of Nastran: bulk data as a mesh (`mesh`) or as a whole deck (`deck`), and matrices (`matrices`)."""

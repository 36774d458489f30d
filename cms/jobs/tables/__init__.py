"""Tables of a reduction job that name nothing but numbers: materials and mesh sizes."""

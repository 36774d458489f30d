"""Tables of a reduction job that do not refer to other tables: materials and mesh sizes."""

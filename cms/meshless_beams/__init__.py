"""Reduced bodies of straight beams from assumed functions, without a mesh."""

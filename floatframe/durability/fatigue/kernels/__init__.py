"""Compiled functions: cycles of streamed histories, with and without normal stress, and scalars of stresses."""

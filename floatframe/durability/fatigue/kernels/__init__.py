"""Compiled: cycles of streamed histories, with and without a normal stress beside them, and scalars of stresses."""

"""Comparison of a mode set with its full model."""

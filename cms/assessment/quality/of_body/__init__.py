"""Checks of a reduced body from its modal file alone."""

"""Routines written out, a module for each language."""

"""Specialised code for one system: its recursive equations as expressions, written out in other languages."""

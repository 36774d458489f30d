"""Conversion of bodies reduced by another program; data that they lack are marked as missing."""

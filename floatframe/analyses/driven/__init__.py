"""Fully driven systems: their motion, which joints and drives determine completely, and the forces it requires."""

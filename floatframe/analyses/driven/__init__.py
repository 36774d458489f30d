"""Fully driven systems: motion from joints and drives alone, and the forces that make it."""

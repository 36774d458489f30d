"""Fully driven systems, whose joints and drives determine the motion completely, and the forces that they require."""

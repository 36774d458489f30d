"""The shaken structure: eliminated interfaces, modes with fixed bases, damping, observed places."""

"""Bodies (rigid, flexible, ground), markers on them, and mass properties."""

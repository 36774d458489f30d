"""Done once before a motion: consistent positions, velocities, accelerations; what is wrong with constraints."""

"""Files: systems, signals, models of other programs, and co-simulation."""

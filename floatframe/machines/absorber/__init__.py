"""A vibration absorber on an oscillator and its design, as files."""

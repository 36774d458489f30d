"""An absorber on an oscillator and its designs, as files."""

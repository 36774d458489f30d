"""Spectra of modal coordinates, distributions of amplitudes, and the damage that follows."""

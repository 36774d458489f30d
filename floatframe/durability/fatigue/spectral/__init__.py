"""Damage from spectra: spectra of modal coordinates, and distributions of stress amplitudes."""

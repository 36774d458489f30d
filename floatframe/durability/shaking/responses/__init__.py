"""Responses of a shaken structure: resolved peaks, steps in time, von Mises stress, response spectra."""

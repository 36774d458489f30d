"""How a shaken structure answers: resolved peaks, steps in time, von Mises' stress, response spectra."""

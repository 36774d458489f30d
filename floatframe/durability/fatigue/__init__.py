"""Fatigue: damage and life on the surface of a flexible body, from histories or spectra of its modal coordinates.

S-N curves, mean stress, criteria, compiled cycle counting, bounds that prove which nodes have negligible damage,
spectral methods, the fatigue file and the output files (docs/fatigue.md).
"""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")

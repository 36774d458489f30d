"""Fatigue: damage and life on the surface of a flexible body, from histories or spectra of its modal coordinates.

S-N curves, mean stress, criteria, cycle counting in compiled code, bounds that prove which nodes cannot matter,
spectral methods, the fatigue file and what is written of a result (docs/fatigue.md).
"""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")

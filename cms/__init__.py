"""Component mode synthesis: from a finite element body to a small, exact, portable modal file.

body = couple(fe_body)
modes = craig_bampton(body, n_modes=12)
write(reduce(body, modes, frame=NodalFrame("big_end")), "rod.h5")
"""

from fe_models.door import open_door

open_door(__name__, "cms.errors:ArgumentError")

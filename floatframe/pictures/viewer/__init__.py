"""A single page, which works offline, that shows a motion, modes or an equilibrium in 3D with plots.

`view` writes it from a record, which the programs in `data` draw. `motion_view` and `modes_view` make the record of a
motion or of modes, with `cast` (appearance of bodies, joints and forces), `surface` (flexible bodies, thinned to a
budget) and `packing` (numbers as text).
"""

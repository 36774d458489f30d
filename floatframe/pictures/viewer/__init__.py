"""A single page, which works offline, that shows a motion, modes or an equilibrium in 3D with plots.

`view` writes it. `cast` (appearance of bodies, joints and forces), `surface` (flexible bodies, thinned to a budget),
`timeline` (selection of rows), `curves` (plots) and `packing` (numbers as text) make a record, which the programs in
`data` draw.
"""

"""One page that shows a motion, modes or an equilibrium in 3D, with its plots, without a network.

`view` writes it: `cast` (what bodies, joints and forces look like), `surface` (flexible bodies, thinned to a budget),
`timeline` (which rows), `curves` (plots), `packing` (numbers as text) make a record that the programs in `data` draw.
"""

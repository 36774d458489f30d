"""Systems, bodies and helpers that several tests share: places."""

import numpy as np

import cms
from floatframe.durability.fatigue.load_blocks import LoadBlock
from floatframe.durability.fatigue.spectral.spectra import spectra_of_history

UNITS = cms.unit_system("m-kg-s")
B, H, LENGTH = 0.02, 0.03, 1.0


def block(body, n=60, seed=0):
    return LoadBlock("noise", np.random.default_rng(seed).standard_normal((n, body.n_q)) * 1e-3)


def noise(body):
    return spectra_of_history("noise", np.arange(4096) * 0.01, block(body, 4096).q)


FILE = """
body = "mast.h5"
survival = 0.9
factors = {{ size = 0.9 }}
[material]
name = "tube"
stress_unit = "MPa"
tensile_strength = 700
sn = {{ amplitude = 1.0, cycles = 1e6, slope = 5, least_cycles = 1, log_deviation = 0.1 }}
{weld}
[criterion]
mean_stress = "goodman"
[counting]
extrapolate = true
[outputs]
places = "{places}"
[[spectra]]
file = "noise.npz"
duration = 60.0
"""

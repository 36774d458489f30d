"""The whole line for beams: tables, sections, reduction, modal file, motion."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import ellipk

import cms
import floatframe as ff
from cms.jobs.job import read_job
from cms.pipeline import reduce_job

GRAVITY = 9.81
JOB = """
[body]
nodes = "nodes.csv"
lines = "lines.csv"
units = "m-kg-s"
{plane}

[materials.steel]
young = 210e9
poisson = 0.3
density = 7850

[sections.rod]
shape = "tube"
radius = 0.03
thickness = 0.004

[masses.bob]
node = "tip"
mass = 2.0
inertia = 0.01

[interfaces.pivot]
kind = "rigid"
nodes = "pivot"

[interfaces.tip]
kind = "nodes"
nodes = "tip"

[reduction]
n_modes = 2
frame = "nodal"
at = "pivot"
"""


@pytest.fixture(scope="module", params=["", 'plane = "zx"'], ids=["space", "planar"])
def reduced(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("beam")
    n = 6
    names = {0: "pivot", n: "tip"}
    rows = "".join(f"{i},{i / n},0,0,{names.get(i, '')}\n" for i in range(n + 1))
    (folder / "nodes.csv").write_text("node,x,y,z,sets\n" + rows)
    (folder / "lines.csv").write_text("node1,node2\n" + "".join(f"{i},{i + 1}\n" for i in range(n)))
    (folder / "rod.toml").write_text(JOB.format(plane=request.param))
    cms.write(reduce_job(read_job(folder / "rod.toml")), folder / "rod.h5")
    return cms.read(folder / "rod.h5")


def test_a_pendulum_of_a_beam_and_a_bob_swings_with_its_period(reduced):
    """Released horizontally: a quarter period is K(sin(pi/4)) / sqrt(m g s / J); the beam is stiff."""
    m_rod = 7850 * np.pi * (0.03**2 - 0.026**2)
    J_rod = m_rod / 3 + m_rod * (0.03**2 + 0.026**2) / 4
    J = J_rod + 2.0 + 0.01
    assert_allclose(reduced.moments.J0[1, 1], J, rtol=1e-12)
    quarter = ellipk(np.sin(np.pi / 4) ** 2) / np.sqrt((m_rod / 2 + 2.0) * GRAVITY / J)
    rod = ff.FlexibleBody("rod", reduced)
    pin = ff.RevoluteJoint("pin", ff.GROUND, ff.Marker("rod", "pivot"), axis=(0, 1, 0))
    system = ff.System([rod], [pin], [ff.Gravity((0, 0, -GRAVITY))], units=reduced.units)
    motion = ff.integrate(system, ff.GeneralizedAlpha(rho_inf=0.8), t_end=1.05 * quarter, h=1e-3).body("rod")
    along = 1 - 2 * motion.p[:, 2] ** 2  # x component of the rod in the ground
    k = int(np.argmax(along < 0))
    lowest = motion.t[k - 1] + (motion.t[k] - motion.t[k - 1]) * along[k - 1] / (along[k - 1] - along[k])
    assert_allclose(lowest, quarter, rtol=1e-4)

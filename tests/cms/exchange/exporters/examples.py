"""Systems, bodies and helpers that several tests share: matrices over interfaces, mbdyn."""

from dataclasses import replace

import numpy as np

import cms
from cms.body.geometric_stiffness import GeometricStiffness
from fe_models.body.load_cases import LoadCase
from tests.bodies import bar, with_interfaces
from tests.cms.exchange.exporters.small_bodies import RUBBER


def stiffened(body):
    """The body with a geometric stiffness of random symmetric matrices."""
    rng = np.random.default_rng(8)
    shapes = {"translation": (3,), "rotation": (3,), "spin": (6,), "interfaces": (len(body.interfaces), 6)}
    K = {name: rng.normal(size=(*first, body.n_q, body.n_q)) for name, first in shapes.items()}
    return replace(body, geometric=GeometricStiffness(**{name: k + k.swapaxes(-1, -2) for name, k in K.items()}))


def reduced_bar(*names):
    """A damped bar with a tip load as load case; interfaces by name, all by default."""
    body = bar(nx=4, material=RUBBER)
    keep = [interface for interface in body.interfaces if not names or interface.name in names]
    f = np.zeros(len(body.dofs))
    f[np.flatnonzero((body.nodes[body.dofs[:, 0], 0] == 1.0) & (body.dofs[:, 1] == 2))] = 0.5
    body = cms.couple(with_interfaces(body, *keep).with_load_cases(LoadCase("tip", "force", f)))
    modes = cms.craig_bampton(body, n_modes=3)
    return cms.reduce(body, modes, damping=cms.reduction.RayleighDamping(0.1, 1e-4), geometric=False)

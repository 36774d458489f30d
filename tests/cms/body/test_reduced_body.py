"""Arrays that a reduced body and its parts cannot hold are refused by name."""

from dataclasses import replace

import numpy as np
import pytest

import cms
from cms.body.stress import PointStress
from cms.errors import BodyError
from tests.bodies import bar

ARRAYS = {
    "": ("M", "K", "D", "energy_shares", "nodes", "Phi", "stress", "quadratic"),
    "moments": ("S", "R", "C1", "P", "S_kl"),
    "nodal_sums": ("S", "R", "U1", "U2"),
    "columns": ("A", "F"),
    "point_stress": ("positions", "modes"),
    "kept": ("rotation",),
    "geometric": ("translation", "rotation", "spin", "interfaces"),
    "geometric.turned": ("translation", "rotation", "spin", "interfaces"),
    "geometric.spread": ("K", "turned", "turned_rigid"),
    "interfaces.0": ("position", "triad", "Psi"),
}


@pytest.fixture(scope="module")
def body():
    """A body with all parts that a reduced body can have."""
    full = cms.couple(bar(3, 1, 1))
    found = cms.reduce(full, cms.craig_bampton(full, n_modes=2), quadratic=True, keep=[full.nodes[0].tolist()])
    rng = np.random.default_rng(5)
    return replace(found, point_stress=PointStress(("a",), rng.normal(size=(1, 3)), rng.normal(size=(1, 6, found.n_q))))


def part_of(body, path):
    for key in path.split(".") if path else ():
        body = body[int(key)] if key.isdigit() else getattr(body, key)
    return body


@pytest.mark.parametrize(("path", "name"), [(path, name) for path, names in ARRAYS.items() for name in names])
def test_an_array_of_another_shape_or_with_nan_is_refused_by_name(body, path, name):
    part = part_of(body, path)
    values = np.asarray(getattr(part, name))
    for wrong in (3.0, values[..., None], np.full(values.shape, np.nan)):
        with pytest.raises(BodyError, match=r"expected|need|matrices of"):
            replace(part, **{name: wrong})
    with pytest.raises(BodyError, match=rf"\b{name}: expected finite numbers"):
        replace(part, **{name: np.where(values == values.flat[-1], np.inf, values)})

"""The estimated error of a mesh against the true one, known from a much finer mesh of the same box."""

import numpy as np
import pytest

from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.mesh_refinement import mesh_refinement
from cms.modes.families.families import Families
from fe_models.elements.solids.body import solid_body
from fe_models.foundation.units import unit_system
from tests.bodies import STEEL, box_mesh

UNITS = unit_system("m-kg-s")
N = 4


def box(n, kind):
    return box_mesh(4 * n, n, n, 4.0, 1.0, 0.7, kind=kind)


@pytest.fixture(scope="module")
def true():
    return Families(solid_body(box(6, "hexahedron20"), STEEL, name="box", units=UNITS)).free_modes(N).frequencies


@pytest.mark.parametrize(
    ("kind", "least", "most"),
    [("tetra", 0.6, 1.0), ("hexahedron", 0.8, 1.0), ("tetra10", 1.2, 2.1), ("hexahedron20", 1.2, 2.1)],
)
def test_estimate_beside_the_true_error(true, kind, least, most):
    """Raised order leaves some of the error untold; half the size with order 1 overestimates, up to 1.9 times."""
    mesh = box(2, kind)
    found = mesh_refinement(mesh, STEEL, units=UNITS, n_modes=N)
    error = Families(solid_body(mesh, STEEL, name="box", units=UNITS)).free_modes(N).frequencies / true - 1
    k = int(np.argmax(error))
    assert least < found.error[k] / error[k] < most


def test_a_finer_model_beyond_the_limit_is_refused():
    with pytest.raises(QualityError, match="more than 100"):
        mesh_refinement(box(1, "tetra10"), STEEL, units=UNITS, most_dofs=100)

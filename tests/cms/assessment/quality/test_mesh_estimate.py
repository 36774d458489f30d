"""The element size that a wanted error needs, from the errors of the elements."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms.jobs.studies.mesh_estimate
import fe_models as fm
from cms.errors import JobError
from cms.jobs.studies.mesh_estimate import MeshEstimate, draw_oversize, mesh_estimate
from cms.reduction.mesh_error import MeshErrors
from fe_models.body.weld import weld
from fe_models.elements.recovery.mesh_error import powers_of_size, surface_elements
from tests.bodies import STEEL, bar, beam, box_mesh

SI = fm.unit_system("m-kg-s")


def estimate_with(body, of_cells):
    """An estimate with given errors of the elements."""
    return MeshEstimate(body, np.ones(1), MeshErrors(np.array([of_cells.sum() / 2]), "+", "", of_cells[:, None]))


@pytest.mark.parametrize(("kind", "power"), [("tetra10", 7), ("hexahedron", 5)])
def test_even_errors_ask_for_one_size_everywhere(kind, power):
    body = fm.solid_body(box_mesh(2, 1, 1, kind=kind), STEEL, name="b", units=SI)
    n = len(body.element_model.mesh.cells[kind])
    even = estimate_with(body, np.full(n, 2 * 0.01 / n))
    assert_allclose(even.oversize(0.01), 1, rtol=1e-12)
    assert_allclose(even.oversize(0.01 / 2**power), 2, rtol=1e-12)
    assert_allclose(even.size_factor(0.01 / 4, rate=2), 0.5, rtol=1e-12)


def test_the_worst_element_is_the_one_that_is_drawn_so(monkeypatch):
    body = fm.solid_body(box_mesh(3, 1, 1), STEEL, name="b", units=SI)
    found = estimate_with(body, np.array([1e-4, 1e-2, 1e-4]))
    scenes = []
    monkeypatch.setattr(cms.jobs.studies.mesh_estimate, "render_picture", lambda scene, _: scenes.append(scene))
    draw_oversize(found, 0.01, Path("any.png"))
    surface = scenes[0].surfaces[0]
    middle = surface.nodes[surface.triangles].mean(axis=1)[:, 0]
    colour = surface.scalars[surface.triangles[:, 0]]
    assert (np.abs(middle[colour == colour.max()] - 0.5) < 0.17).all()
    assert_allclose(colour.max() / colour.min(), 100 ** (1 / 5), rtol=1e-12)


def test_surfaces_of_welded_bodies_belong_to_the_elements_of_their_parts():
    left, right = (fm.couple(bar(nx=n, kind=kind)) for n, kind in ((2, "hexahedron20"), (3, "hexahedron")))
    model = weld(
        [left, replace(right, name="other")], [(("bar", "right"), ("other", "left"))], name="both"
    ).element_model
    cells = surface_elements(model)
    assert_allclose(powers_of_size(model), [7, 7, 5, 5, 5])
    assert len(cells) == sum(len(each.surface) for each in (left, right))
    assert cells[: len(left.surface)].max() == 1
    assert set(cells[len(left.surface) :]) == {2, 3, 4}


def test_a_body_without_an_estimate_has_no_picture():
    found = mesh_estimate(fm.couple(beam()), 3)
    assert np.isnan(found.worst)
    with pytest.raises(JobError, match="the error of the mesh: none: the body consists of matrices"):
        found.oversize(0.01)


def test_the_estimate_of_a_body_is_that_of_its_reduction():
    body = fm.couple(bar(nx=4, kind="hexahedron"))
    found = mesh_estimate(body, 4)
    made = cms.reduce(body, cms.modes.normal_modes(body, 4), errors=True)
    assert_allclose(found.errors.frequency, made.errors.mesh[:4], rtol=1e-3)
    assert_allclose(found.frequencies, made.free_frequencies[:4], rtol=1e-9)

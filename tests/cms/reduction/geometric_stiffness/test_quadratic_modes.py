"""Displacement of second order of the nodes: rotations to second order, interfaces, and the shortening of a beam."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import cms
from cms.errors import BodyError
from cms.reduction.basis.frames import BuckensFrame, NodalFrame, TisserandFrame, frame_condition
from cms.reduction.frame_conversion import convert_frame
from cms.reduction.geometric_stiffness.quadratic_modes import quadratic_modes
from cms.reduction.reduction import kept_nodes
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from tests.bodies import STEEL, bar
from tests.cms.reduction.geometric_stiffness.examples import bar_of_beams, some_bodies


def without_rigid_motion(points, field):
    """Return a field of vectors at points less its best rigid motion, (n, 3)."""
    c = points - points.mean(axis=0)
    rigid = np.concatenate([np.tile(np.eye(3), (len(c), 1, 1)), -np.cross(np.eye(3), c[:, None]).transpose(0, 2, 1)], 2)
    R = rigid.reshape(-1, 6)
    return field - (R @ np.linalg.lstsq(R, field.ravel(), rcond=None)[0]).reshape(-1, 3)


@pytest.mark.parametrize("frame", [TisserandFrame(), NodalFrame(), BuckensFrame()], ids=lambda f: type(f).__name__)
@pytest.mark.parametrize("name", ["rigid", "distributing", "nodes", "linked", "welded"])
def test_a_deformed_body_that_turns_is_a_deformed_body_that_is_turned(name, frame):
    """R (c + phi) = c + phi + theta × c + theta × phi + ½ theta × (theta × c) + ..., but for a rigid motion."""
    body = some_bodies()[name]
    condition = frame_condition(body, frame)
    nodes = kept_nodes(body)
    phi = np.random.default_rng(3).standard_normal((body.n_dof, 1))
    phi[body.dofs[:, 1] < 0] = 0.0
    with cms.modes.Families(body) as families:
        phi = families.flexibility(phi)
        phi /= np.abs(phi).max()
        turns = rigid_motion_of_dofs(body.nodes, body.dofs)[:, 3:]
        g = quadratic_modes(families, np.hstack([turns, phi]), condition, nodes)
    axes, points = condition.frame.axes, body.nodes[nodes]
    on_mesh = np.einsum("ab,nbkl->nakl", axes, g)
    moved = body.translations(phi)[nodes][..., 0]
    for a, e in enumerate(np.eye(3)):
        turned = np.cross(e, moved)
        found = without_rigid_motion(points, on_mesh[:, :, a, 3])
        assert_allclose(found, without_rigid_motion(points, turned), rtol=0, atol=1e-8 * np.abs(turned).max())
        for b, f in enumerate(np.eye(3)):
            turned = (np.cross(e, np.cross(f, points)) + np.cross(f, np.cross(e, points))) / 2
            found = without_rigid_motion(points, on_mesh[:, :, a, b])
            assert_allclose(found, without_rigid_motion(points, turned), rtol=0, atol=1e-8 * np.abs(points).max())


def test_interface_nodes_have_the_second_order_of_the_interfaces():
    body = cms.couple(bar_of_beams(6))
    reduced = cms.reduce(body, cms.craig_bampton(body, n_modes=4), quadratic=True)
    for k, interface in enumerate(reduced.interfaces):
        node = int(np.argmin(np.linalg.norm(reduced.nodes - interface.position, axis=1)))
        assert_allclose(reduced.nodes[node], interface.position, atol=1e-12)
        assert_allclose(
            -reduced.quadratic[node], reduced.geometric.interfaces[k, :3], rtol=0,
            atol=1e-10 * np.abs(reduced.geometric.interfaces[k]).max(),
        )  # fmt: skip


def test_a_bent_cantilever_comes_nearer_by_half_the_square_of_its_slope():
    """u_x = -½ ∫ w'² of w = (3 L x² - x³)/(6 EI), at every station; nodal frame at the clamped end."""
    L = 1.0
    body = cms.couple(bar_of_beams(12, length=L))
    modes = cms.craig_bampton(body, n_modes=0)
    reduced = cms.reduce(body, modes, frame=NodalFrame("left"), quadratic=True)
    tip = reduced.interface("right")
    f = np.linalg.solve(np.asarray(reduced.K), np.asarray(tip.Psi)[2])  # unit force along z at the tip
    g = 0.5 * np.einsum("nakl,k,l->na", reduced.quadratic, f, f)
    x = np.unique(reduced.nodes[:, 0].round(9))
    shortening = np.array([g[np.abs(reduced.nodes[:, 0] - at) < 1e-6, 0].mean() for at in x])  # of whole sections
    slope2 = (L**2 * x**3 / 3 - L * x**4 / 4 + x**5 / 20) / (STEEL.E * 0.05 * 0.04**3 / 12) ** 2
    assert len(x) == 13
    assert_allclose(shortening, -0.5 * slope2, rtol=0, atol=5e-3 * slope2.max())  # shear bends it a little too


def test_the_field_fits_the_file_the_modes_and_the_rest():
    body = cms.couple(bar_of_beams(4))
    reduced = cms.reduce(body, cms.craig_bampton(body, n_modes=2), quadratic=True)
    assert reduced.geometric is not None
    assert_allclose(reduced.quadratic, np.swapaxes(reduced.quadratic, 2, 3), rtol=0, atol=1e-12)
    in_mm = cms.body.convert_units(reduced, "mm-t-s")
    q = np.random.default_rng(0).standard_normal(reduced.n_q)
    p = np.sqrt(1e-3) * 1e3 * q  # mass^(1/2) length
    assert_allclose(
        np.einsum("nakl,k,l->na", in_mm.quadratic, p, p),
        1e3 * np.einsum("nakl,k,l->na", reduced.quadratic, q, q), rtol=1e-10, atol=1e-12,
    )  # fmt: skip
    assert convert_frame(reduced, NodalFrame("left")).quadratic is None
    with pytest.raises(BodyError, match="quadratic modes need the geometric stiffness"):
        replace(reduced, geometric=None)


def test_written_and_read_it_is_the_same(tmp_path):
    body = cms.couple(bar_of_beams(3))
    reduced = cms.reduce(body, cms.craig_bampton(body, n_modes=1), quadratic=True)
    cms.write(reduced, tmp_path / "bar.h5")
    assert_array_equal(cms.read(tmp_path / "bar.h5").quadratic, reduced.quadratic)


def test_too_large_a_field_is_refused(monkeypatch):
    monkeypatch.setattr("cms.reduction.geometric_stiffness.quadratic_modes.MOST_NUMBERS", 1000)
    body = cms.couple(bar(2, 1, 1))
    with pytest.raises(BodyError, match="meant for slender bodies"):
        cms.reduce(body, cms.craig_bampton(body, n_modes=2), quadratic=True)

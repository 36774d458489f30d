import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from cms.errors import BodyError
from cms.modes.mode_sets import MODE_SETS
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from tests.fe_models.small_frames import STEEL, straight

ROUNDOFF = 1e-12


@pytest.fixture(scope="module")
def spatial():
    return cms.couple(straight(8, interfaces=("start", "end")))


@pytest.mark.parametrize("kind", ["rigid", "nodes"])
def test_planar_beam_keeps_three_dofs_a_node_and_all_rigid_motion(kind):
    body = fm.planar(cms.couple(straight(8, interfaces=("start", "end"), kind=kind)))
    assert body.n_dof == 3 * 9 + 3
    assert [len(interface.dofs) for interface in body.interfaces] == [6, 3]
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs)
    assert np.linalg.matrix_rank(Psi_R) == 6
    assert_allclose(body.K @ Psi_R, 0, rtol=0, atol=ROUNDOFF * np.abs(body.K.data).max())
    assert (np.linalg.eigvalsh(body.K.toarray()) > 1e-9 * np.abs(body.K.data).max()).sum() == body.n_dof - 6


def test_planar_beam_has_the_in_plane_frequencies_of_the_beam_in_space(spatial):
    """The in-plane motion of a straight beam does not couple with the rest."""
    body = fm.planar(spatial)
    in_plane = np.flatnonzero(np.isin(spatial.dofs[:, 1], (0, 1, 5)))
    K, M = (A.toarray()[np.ix_(in_plane, in_plane)] for A in (spatial.K, spatial.M))
    import scipy.linalg as la

    expected = la.eigh(K, M, eigvals_only=True)[3:]
    found = la.eigh(body.K.toarray(), body.M.toarray(), eigvals_only=True)[6:]
    assert_allclose(found, expected, rtol=1e-8)


def test_planar_beam_has_the_mass_and_inertia_of_the_beam_in_space(spatial):
    body = fm.planar(spatial)
    frame = cms.NodalFrame("start")
    flat, full = (cms.reduce(b, cms.craig_bampton(b, n_modes=2), frame=frame).moments for b in (body, spatial))
    assert_allclose(flat.m, full.m, rtol=1e-12)
    assert_allclose(flat.J0, full.J0, rtol=0, atol=1e-12 * full.J0.max())
    assert not flat.C1[2].any() or np.abs(flat.C1[2]).max() < 1e-12 * np.abs(flat.C1).max()


def test_interface_with_three_dofs_turns_with_its_node(spatial):
    """The marker of the second interface has all six motions: slope of the deflection about z, nothing out of plane."""
    reduced = cms.reduce(fm.planar(spatial), cms.modes.guyan(fm.planar(spatial)), frame=cms.NodalFrame("start"))
    full = cms.reduce(spatial, cms.modes.guyan(spatial), frame=cms.NodalFrame("start"))
    Psi = reduced.interface("end").Psi
    assert_allclose(Psi[2:5], 0, rtol=0, atol=1e-12 * np.abs(Psi).max())
    slopes = {round(abs(rz / uy), 6) for uy, rz in Psi[[1, 5]].T if abs(uy) > 1e-9}
    in_space = {round(abs(rz / uy), 6) for uy, rz in full.interface("end").Psi[[1, 5]].T if abs(uy) > 1e-9}
    assert slopes == in_space


def test_loads_keep_their_resultants(spatial):
    load = fm.loads.gravity_load(spatial, "weight", (1.0, 2.0, 3.0))
    flat = fm.planar(spatial.with_load_cases(load))
    resultant = rigid_motion_of_dofs(flat.nodes, flat.dofs).T @ flat.load_cases[0].f
    assert_allclose(resultant, rigid_motion_of_dofs(spatial.nodes, spatial.dofs).T @ load.f, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["craig-bampton-ir", "herting", "rubin", "craig-chang", "unrestrained-attachment"])
def test_columns_out_of_the_plane_are_dropped_and_not_made_of_rounding(spatial, name):
    """Six boundary dofs in the plane: 3 deformations, 3 of inertia relief, 4 modes; the bob makes everything uneven."""
    mesh = fm.beams.straight_line((0, 0, 0), (1, 0, 0), 8)
    ends = [fm.beams.line_interface(mesh, end, fm.selections.NodeSet(end)) for end in ("start", "end")]
    bob = [fm.beams.PointMass(8, 2.0, 0.01)]
    body = fm.beam_body(
        mesh,
        fm.beams.BeamProperty(fm.beams.Tube(0.02, 0.003), STEEL),
        name="b",
        units=spatial.units,
        interfaces=ends,
        point_masses=bob,
    )
    flat = fm.planar(cms.couple(body), normal=1)
    modes = MODE_SETS[name](flat, n_modes=4)
    reduced = cms.reduce(flat, modes)
    assert reduced.n_q == 10
    dropped = reduced.provenance["mode set redundant"].split("; ")
    assert len(dropped) == 3
    assert {label.split()[-1] for label in dropped} == {"uy", "rx", "rz"}


def test_every_axis_can_be_the_normal():
    for normal, kept in ((0, (1, 2, 3)), (1, (0, 2, 4)), (2, (0, 1, 5))):
        body = fm.planar(cms.couple(straight(3, interfaces=("start", "end"))), normal=normal)
        assert set(body.dofs[body.dofs[:, 0] != body.dofs[body.b[0], 0], 1].tolist()) == set(kept)


def test_planar_refuses_what_it_cannot_do(spatial):
    with pytest.raises(BodyError, match=r"call cms\.couple"):
        fm.planar(straight(2, interfaces=("start",)))
    with pytest.raises(BodyError, match="expected axis 0, 1 or 2"):
        fm.planar(spatial, normal=3)
    mesh = fm.beams.LineMesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1), (0, 2)])
    spread = fm.beams.line_interface(mesh, "all", fm.beams.NodeIndices((0, 1, 2)), kind="distributing")
    body = fm.beam_body(
        mesh, fm.beams.BeamProperty(fm.beams.Circle(0.01), STEEL), name="b", units=spatial.units, interfaces=[spread]
    )
    with pytest.raises(BodyError, match="distributing interfaces"):
        fm.planar(cms.couple(body))

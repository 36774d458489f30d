"""A reduced body converted to another frame is the body reduced in that frame; what physics fixes stays."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

from cms.body.modal_file.file import read
from cms.errors import BodyError
from cms.modes.mode_sets import craig_bampton
from cms.reduction import reduction
from cms.reduction.basis.damping import ModalDamping, RayleighDamping
from cms.reduction.basis.frames import BuckensFrame, NodalFrame, TisserandFrame
from cms.reduction.frame_conversion import convert_frame
from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import FEBody, Interface
from tests.bodies import bar, beam, chain, with_interfaces
from tests.cms.examples import FRAMES as OF_FRAMES
from tests.cms.examples import TURNED, uneven_bar
from tests.root import ROOT
from tests.synthetic import synthetic_reduced_body

FRAMES = OF_FRAMES | {"nodal right turned": NodalFrame("right", axes=TURNED)}
SLACK = 1e-8  #: roundoff times the condition of M in another frame, relative to the largest entry


def reduce(*args, **options):
    """Return the reduced body without geometric stiffness, which tests of that room carry from frame to frame."""
    return reduction.reduce(*args, **options, geometric=False)


@pytest.fixture(scope="module")
def made():
    """Return the body and its reductions in all frames, from one mode set."""
    body = couple(uneven_bar())
    modes = craig_bampton(body, n_modes=5)
    return body, {name: reduce(body, modes, frame=frame) for name, frame in FRAMES.items()}


def signs(a, b):
    """Return the sign of each mode of b in a: no frequency of this body is multiple."""
    return np.sign(np.einsum("nck,nck->k", a.Phi, b.Phi))


def assert_close(actual, expected, what, slack=SLACK):
    scale = np.abs(expected).max(initial=0.0)
    assert_allclose(actual, expected, rtol=0, atol=slack * scale, err_msg=what)


def assert_same_body(a, b, slack=SLACK):
    """Every number of a is that of b, but for the signs of modes."""
    s = signs(a, b)
    assert_allclose(a.frame.origin, b.frame.origin, rtol=0, atol=1e-12)
    assert_allclose(a.frame.axes, b.frame.axes, rtol=0, atol=1e-12)
    assert_allclose(a.frequencies, b.frequencies, rtol=slack)
    assert_allclose(a.free_frequencies, b.free_frequencies, rtol=slack)
    assert_close(a.D, b.D * np.outer(s, s), "D", slack)
    assert_close(a.nodes, b.nodes, "nodes", slack)
    assert_close(a.Phi, b.Phi * s, "Phi", slack)
    largest = max(np.abs(i.Psi).max() for i in b.interfaces)
    for i, j in zip(a.interfaces, b.interfaces, strict=True):
        assert_allclose(i.position, j.position, rtol=0, atol=1e-12)
        assert_allclose(i.triad, j.triad, rtol=0, atol=1e-12)
        assert_allclose(i.Psi, j.Psi * s, rtol=0, atol=slack * largest)
    m, n = a.moments, b.moments
    for name, factor in {"m": 1, "S": 1, "R": 1, "P": s, "S_kl": np.outer(s, s), "J0": 1}.items():
        scale = max(np.abs(getattr(n, name)).max(), n.m if name == "S" else 0)
        assert_allclose(getattr(m, name), getattr(n, name) * factor, rtol=0, atol=slack * scale, err_msg=name)
    assert_allclose(m.C1, n.C1 * s, rtol=0, atol=slack * np.sqrt(n.m))
    assert_allclose(a.energy_shares, b.energy_shares, rtol=0, atol=slack)
    assert [label.split(" (")[0] for label in a.labels] == [label.split(" (")[0] for label in b.labels]
    if b.stress is not None:
        assert_close(a.stress, b.stress * s, "stress", slack)
    if b.nodal_sums is not None:
        u, v = a.nodal_sums, b.nodal_sums
        size = np.abs(b.Phi).max() * v.w
        for name, x, y, scale in [("w", u.w, v.w, v.w), ("S", u.S, v.S, v.w), ("R", u.R, v.R, v.w),
                                  ("U1", u.U1, v.U1 * s, size), ("U2", u.U2, v.U2 * s, size)]:  # fmt: skip
            assert_allclose(x, y, rtol=0, atol=slack * scale, err_msg=name)
    for i, j in zip(a.load_cases, b.load_cases, strict=True):
        assert_close(np.r_[i.force, i.torque], np.r_[j.force, j.torque], i.name, slack)
        assert_allclose(i.h, j.h * s, rtol=0, atol=slack * np.linalg.norm(j.force) * np.abs(b.Phi).max())


@pytest.mark.parametrize("target", FRAMES)
@pytest.mark.parametrize("source", ["tisserand", "nodal left", "buckens turned"])
def test_a_converted_body_is_the_one_reduced_in_that_frame(made, source, target):
    _, bodies = made
    assert_same_body(convert_frame(bodies[source], FRAMES[target]), bodies[target])


@pytest.mark.parametrize("target", ["tisserand turned", "nodal right", "nodal left", "buckens turned"])
@pytest.mark.parametrize("source", ["tisserand", "nodal left", "buckens turned"])
def test_moments_approximated_from_matrices_are_those_of_one_body_in_every_frame(source, target):
    """A rigid interface has anisotropic inertia in one node, so products of fields only approximate its moments."""
    body = replace(couple(uneven_bar()), element_model=None)
    modes = craig_bampton(body, n_modes=3)
    direct = reduce(body, modes, frame=FRAMES[target])
    assert not direct.moments.is_exact
    assert_same_body(convert_frame(reduce(body, modes, frame=FRAMES[source]), FRAMES[target]), direct)


@pytest.mark.parametrize("over", ["tisserand turned", "nodal right", "buckens"])
def test_there_and_back_is_the_same_body(made, over):
    _, bodies = made
    start = bodies["nodal left"]
    assert_same_body(convert_frame(convert_frame(start, FRAMES[over]), NodalFrame("left")), start)


def test_a_converted_body_satisfies_the_condition_of_its_frame(made):
    _, bodies = made
    start = bodies["nodal right turned"]
    mean = convert_frame(start, TisserandFrame())
    size = np.sqrt(start.moments.m)
    assert_allclose(mean.moments.C1, 0, rtol=0, atol=1e-10 * size)
    assert_allclose(mean.moments.C2, 0, rtol=0, atol=1e-10 * size)
    assert_allclose(mean.moments.S, 0, rtol=0, atol=1e-12 * start.moments.m)
    held = convert_frame(start, NodalFrame("left")).interface("left")
    assert_allclose(held.Psi, 0, rtol=0, atol=1e-10 * np.abs(start.interface("left").Psi).max())
    least = convert_frame(start, BuckensFrame()).nodal_sums
    assert_allclose(np.r_[least.U1, least.U2], 0, rtol=0, atol=1e-10 * least.w * np.abs(start.Phi).max())


def test_buckens_frame_has_the_least_deformation_of_all_frames(made):
    """Σ w |u|² of any deformation grows when a rigid motion is added, and its derivative there is zero."""
    body, bodies = made
    reduced = bodies["buckens"]
    w = np.zeros(len(body.nodes))
    w[: len(body.node_volumes)] = body.node_volumes
    weights = w[reduced.node_ids]  # every node of this thin mesh is on the surface
    assert_allclose(weights.sum(), w.sum(), rtol=1e-14)
    from fe_models.body.rigid_motion import rigid_motion_of_points

    Psi_R = rigid_motion_of_points(reduced.nodes, np.zeros(3))
    slope = np.einsum("n,nac,nak->ck", weights, Psi_R, reduced.Phi)
    assert_allclose(slope, 0, rtol=0, atol=1e-12 * weights.sum() * np.abs(reduced.Phi).max())
    size = np.einsum("n,nak->k", weights, reduced.Phi**2)
    for other in ("tisserand", "nodal left"):
        z = np.linalg.lstsq(*coefficients(bodies[other], reduced), rcond=None)[0]  # the same deformations
        assert (np.einsum("n,nak->k", weights, np.einsum("nak,kl->nal", bodies[other].Phi, z) ** 2) > size).all()


def coefficients(other, reduced):
    """Return stress of two bodies as systems: equal stress is equal deformation."""
    return other.stress.reshape(-1, other.n_q), reduced.stress.reshape(-1, reduced.n_q)


def test_without_volumes_every_mesh_node_counts_the_same(made):
    body, _ = made
    bare = replace(body, node_volumes=None)
    modes = craig_bampton(bare, n_modes=5)
    reduced = reduce(bare, modes, frame=BuckensFrame())
    on_mesh = reduced.node_ids < len(body.nodes) - 2  # reference nodes come last and count nothing
    u, c = reduced.Phi[on_mesh], reduced.nodes[on_mesh]
    size = np.abs(u).max() * len(u)
    assert_allclose(c.sum(axis=0), 0, rtol=0, atol=1e-12 * len(u))
    assert_allclose(u.sum(axis=0), 0, rtol=0, atol=1e-12 * size)
    assert_allclose(np.cross(c[..., None], u, axisa=1, axisb=1, axisc=1).sum(axis=0), 0, rtol=0, atol=1e-12 * size)
    assert reduced.nodal_sums.w == on_mesh.sum()
    assert_same_body(convert_frame(reduce(bare, modes, frame=NodalFrame("left")), BuckensFrame()), reduced)


def test_free_frequencies_and_elastic_energy_do_not_depend_on_the_frame(made):
    """The pencil of a frame on its own does; with the six rigid-body motions added back it does not."""
    import scipy.linalg as la

    _, bodies = made
    expected = None
    for reduced in (bodies["nodal left"], *(convert_frame(bodies["nodal left"], f) for f in FRAMES.values())):
        m = reduced.moments
        Y = np.vstack([m.C1, m.C2])
        skew = np.cross(m.S, np.eye(3)).T
        M = np.block([[m.m * np.eye(3), skew.T, m.C1], [skew, m.J0, m.C2], [Y.T, reduced.M]])
        K = la.block_diag(np.zeros((6, 6)), reduced.K)
        omega2 = la.eigh(K, M, eigvals_only=True)
        free = np.sqrt(omega2[6:]) / (2 * np.pi)
        expected = free if expected is None else expected
        assert_allclose(free, expected, rtol=1e-7)
    assert_allclose(expected, bodies["nodal left"].free_frequencies, rtol=1e-7)


def test_static_response_to_a_self_balanced_load_is_the_same_deformation_in_every_frame(made):
    """Equal and opposite pulls at the ends: stress, strain energy and the change of distance are physical."""
    body, bodies = made
    arm = body.interface("right").reference - body.interface("left").reference
    pair = {"left": np.r_[-5.0, -1, -2, -np.cross(arm, [5.0, 1, 2])], "right": np.r_[5.0, 1, 2, 0, 0, 0]}
    results = []
    for reduced in (
        bodies["tisserand"],
        *(convert_frame(bodies["tisserand"], FRAMES[n]) for n in ("buckens", "nodal")),
    ):
        h = sum(reduced.interface(name).Psi.T @ f for name, f in pair.items())
        q = h / np.diag(reduced.K)
        results.append(np.r_[reduced.stress @ q @ np.ones(6), h @ q])
    for other in results[1:]:
        assert_allclose(other, results[0], rtol=0, atol=1e-9 * np.abs(results[0]).max())


def test_damping_is_carried_as_it_is_or_made_anew(made):
    body, _ = made
    modes = craig_bampton(body, n_modes=5)
    start = reduce(body, modes, frame=NodalFrame("left"), damping=RayleighDamping(0.0, 1e-5))
    expected = reduce(body, modes, damping=RayleighDamping(0.0, 1e-5))
    assert_same_body(convert_frame(start, TisserandFrame()), expected)
    anew = convert_frame(start, TisserandFrame(), damping=ModalDamping(0.03))
    assert_same_body(anew, reduce(body, modes, damping=ModalDamping(0.03)))
    by_ratio = reduce(body, modes, frame=NodalFrame("left"), damping=ModalDamping(0.03))
    carried = convert_frame(by_ratio, TisserandFrame())  # not the ratios of the new modes, but the same loss
    assert np.abs(carried.D - np.diag(np.diag(carried.D))).max() > 0.01 * carried.D.max()
    rates = np.random.default_rng(0).normal(size=carried.n_q)
    Z = np.linalg.lstsq(*coefficients(by_ratio, carried), rcond=None)[0]
    assert_allclose(rates @ carried.D @ rates, (Z @ rates) @ by_ratio.D @ (Z @ rates), rtol=1e-9)


@pytest.mark.parametrize("kinds", [("nodes", "rigid"), ("nodes", "nodes")])
def test_nodal_frames_of_interfaces_kept_node_by_node_hold_the_same_six_dofs(kinds):
    body = couple(uneven_bar(kinds))
    modes = craig_bampton(body, n_modes=2)
    start = reduce(body, modes)
    for frame in (NodalFrame("left"), NodalFrame()):
        expected = reduce(body, modes, frame=frame)
        converted = convert_frame(start, frame)
        np.testing.assert_array_equal(converted.frame.dofs, expected.frame.dofs)
        assert expected.frame.dofs.shape == (6, 2)
        assert_same_body(converted, expected)


def test_given_dofs_are_held(made):
    body, bodies = made
    dofs = ((0, 0), (0, 1), (0, 2), (body.interface("right").nodes[0], 1), (body.interface("right").nodes[0], 2))
    third = body.interface("left").nodes[2]
    component = next(c for c in (1, 2) if abs(body.nodes[third, 3 - c] - body.nodes[0, 3 - c]) > 0.01)
    frame = NodalFrame(dofs=(*((int(n), c) for n, c in dofs), (int(third), component)))
    modes = craig_bampton(body, n_modes=5)
    reduced = reduce(body, modes, frame=frame)
    row = {int(n): k for k, n in enumerate(reduced.node_ids)}
    for node, c in frame.dofs:  # also of nodes that the rigid interface has taken the dofs of
        assert_allclose(reduced.Phi[row[node], c], 0, rtol=0, atol=1e-10 * np.abs(reduced.Phi).max())
    assert_same_body(convert_frame(bodies["tisserand turned"], frame), reduced)


def test_a_beam_in_its_nodes_is_converted_with_its_rotations():
    body = beam(4)
    modes = craig_bampton(couple(body), n_modes=3)
    start = reduce(couple(body), modes, frame=NodalFrame("left"))
    assert all(interface.has_rotation for interface in start.interfaces)
    converted = convert_frame(start, TisserandFrame())
    expected = reduce(couple(body), modes)
    assert_allclose(converted.frequencies, expected.frequencies, rtol=1e-8)
    s = np.sign(np.einsum("ik,ik->k", converted.interface("right").Psi, expected.interface("right").Psi))
    for name in ("left", "right"):
        Psi = expected.interface(name).Psi
        assert_allclose(converted.interface(name).Psi * s, Psi, rtol=0, atol=1e-8 * np.abs(Psi).max())


def test_interfaces_on_one_line_move_with_the_middle_of_their_members():
    body = uneven_bar()
    left, right = body.interfaces
    edge = right.nodes[np.argsort(body.nodes[right.nodes, 2])[:2]]
    on_line = replace(
        right, kind="nodes", nodes=edge, weights=None, reference=body.nodes[edge].mean(axis=0) + np.array([0.2, 0, 0])
    )
    coupled = couple(with_interfaces(replace(body, load_cases=()), left, on_line))
    modes = craig_bampton(coupled, n_modes=2)
    start = reduce(coupled, modes, frame=NodalFrame("left"))
    assert not start.interface("right").has_rotation
    assert_same_body(convert_frame(start, TisserandFrame()), reduce(coupled, modes))


def test_a_body_of_point_masses_keeps_its_moments_in_sums():
    """Second road: moments of the converted shapes by plain sums over the point masses."""
    body = synthetic_reduced_body(n_q=4, n_nodes=12, units="m-kg-s")
    mass = np.random.default_rng(0).uniform(0.5, 2.0, 12)
    held = NodalFrame(dofs=((0, 0), (0, 1), (0, 2), (7, 1), (7, 2), (14, 0)), axes=TURNED)
    for frame in (TisserandFrame(axes=TURNED), held):
        new = convert_frame(body, frame)
        c, Phi, m = new.nodes, new.Phi, new.moments
        assert_allclose(m.S, mass @ c, rtol=0, atol=1e-11 * mass.sum())
        assert_allclose(m.R, np.einsum("n,na,nb->ab", mass, c, c), rtol=0, atol=1e-11 * mass.sum())
        assert_allclose(m.P, np.einsum("n,na,nbk->abk", mass, c, Phi), rtol=0, atol=1e-10)
        assert_allclose(m.S_kl, np.einsum("n,nak,nbl->abkl", mass, Phi, Phi), rtol=0, atol=1e-10)
        assert_allclose(new.moments.M, np.eye(4), rtol=0, atol=1e-10)


def test_a_file_of_version_1_is_converted_and_says_what_it_lacks():

    old = read(ROOT / "tests" / "cms" / "body" / "modal_file" / "data" / "version_1.h5")
    assert old.columns is None
    new = convert_frame(old, TisserandFrame())
    assert_allclose(new.moments.C2, 0, rtol=0, atol=1e-10)
    assert new.energy_shares.shape == (2, 2)
    assert all(label.startswith("nodal mode ") for label in new.labels)
    with pytest.raises(BodyError, match="not stored"):
        convert_frame(old, BuckensFrame())


def test_impossible_frames_are_refused():
    reduced = reduce(
        couple(bar(nx=3, kind="hexahedron")), craig_bampton(couple(bar(nx=3, kind="hexahedron")), n_modes=1)
    )
    for frame, words in [
        (NodalFrame("lefft"), "did you mean 'left'"),
        (NodalFrame("left", dofs=((0, 0),) * 6), "either at .* or dofs, got both"),
        (NodalFrame(dofs=((0, 0),) * 6), "hold only 1 of the 6"),
        (NodalFrame(dofs=((0, 0),) * 5), "expected six pairs"),
        (NodalFrame(dofs=((0, 3),) * 6), "no rotations of single nodes"),
        (NodalFrame(dofs=((999, 0),) * 6), "node 999 not"),
        (TisserandFrame(axes=((1, 0, 0), (0, 1, 0), (0, 0, -1))), "three orthonormal right-handed axes"),
    ]:
        with pytest.raises(BodyError, match=words):
            convert_frame(reduced, frame)
    coupled = couple(bar(nx=3, kind="hexahedron"))
    modes = craig_bampton(coupled, n_modes=1)
    for frame, words in [
        (NodalFrame(dofs=((0, 0),) * 6), "hold only 1 of the 6"),
        (NodalFrame(dofs=((0, 4),) * 6), "node 0 has no component 4"),
        (NodalFrame("left", dofs=((0, 0),) * 6), "got both"),
    ]:
        with pytest.raises(BodyError, match=words):
            reduce(coupled, modes, frame=frame)
    row = couple(chain())
    with pytest.raises(BodyError):
        reduce(row, craig_bampton(row, n_modes=1), frame=BuckensFrame())


def test_static_shapes_without_mass_stay_static_in_every_frame():
    """A massless node on springs beside the bar: its three shapes have no mass in either frame."""
    free = bar(nx=3, kind="hexahedron")
    n, N = len(free.nodes), free.n_dof
    tip = np.array([1.3, 0.02, 0.02])
    K = sp.block_diag([free.K, sp.csc_array((3, 3))]).tolil()
    for k, node in enumerate(free.interfaces[1].nodes[:3]):
        along = tip - free.nodes[node]
        spring = 1e6 * (k + 1) * np.outer(along, along)
        dofs = np.r_[3 * node + np.arange(3), N + np.arange(3)]
        K[np.ix_(dofs, dofs)] += np.block([[spring, -spring], [-spring, spring]])
    body = couple(
        FEBody(
            "bar with a light tip",
            sp.block_diag([free.M, sp.csc_array((3, 3))]),
            K,
            np.vstack([free.nodes, tip]),
            np.vstack([free.dofs, [[n, 0], [n, 1], [n, 2]]]),
            (*free.interfaces, Interface("tip", "nodes", np.array([n]), tip)),
            surface=free.surface,
        )
    )
    modes = craig_bampton(body, n_modes=3)
    expected = reduce(body, modes)
    converted = convert_frame(reduce(body, modes, frame=NodalFrame("left")), TisserandFrame())
    assert int((np.diag(expected.M) == 0).sum()) == 3
    np.testing.assert_array_equal(converted.M, expected.M)
    assert_allclose(converted.frequencies, expected.frequencies, rtol=SLACK)
    assert_close(converted.Phi, expected.Phi * signs(converted, expected), "Phi")

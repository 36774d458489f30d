import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.of_reduction.frf import (
    basis_ports,
    compare_responses,
    frequency_grid,
    peaks,
    resonance_grid,
    response_comparison,
)
from cms.assessment.quality.plots import frf_figure, plot_frf
from cms.assessment.quality.reference.full_reference import FullReference
from cms.assessment.quality.reference.port_model import file_resonances, frf, modal_response, port_model
from cms.assessment.quality.reference.ports import Ports
from cms.assessment.quality.reference.reference_response import RESPONSE_TOLERANCE, reference_response
from cms.modes.families.families import Families
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets import MODE_SETS, craig_bampton
from cms.reduction.basis.damping import ModalDamping
from cms.reduction.basis.frames import NodalFrame, TisserandFrame
from cms.reduction.basis.free_basis import free_basis
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import Interface
from fe_models.elements.solids.body import solid_body
from fe_models.foundation.units import unit_system
from tests.bodies import STEEL, bar, box_mesh, with_interfaces

FREQUENCIES = np.array([5.0, 80.0, 400.0, 900.0, 1700.0, 2400.0])


@pytest.fixture(scope="module")
def body():
    return couple(bar(nx=6, kind="hexahedron"))


@pytest.fixture(scope="module")
def mixed():
    """A rigid, a distributing and a nodes interface on one body."""
    mesh = box_mesh(4, 2, 2, 1.0, 0.2, 0.15, "hexahedron")
    top = np.flatnonzero((mesh.nodes[:, 2] == 0.15) & (np.abs(mesh.nodes[:, 0] - 0.5) < 0.26))
    free = solid_body(mesh, STEEL, name="mixed", units=unit_system("m-kg-s"))
    interfaces = (
        Interface("left", "rigid", mesh.node_sets["left"], np.array([0.0, 0.1, 0.075])),
        Interface("right", "distributing", mesh.node_sets["right"], np.array([1.0, 0.1, 0.075])),
        Interface("top", "nodes", top, mesh.nodes[top].mean(axis=0)),
    )
    return couple(with_interfaces(free, *interfaces))


@pytest.fixture(scope="module")
def reference(body):
    with FullReference(body, band=2500.0) as made:
        yield made


def unit_set(body) -> ModeSet:
    n = body.n_dof
    return ModeSet("unit", np.eye(n), [f"dof {k}" for k in range(n)], np.full(n, np.nan))


def dense_response(body, frequencies, damping=0.0):
    """H by a dense solve per frequency; modal damping by D = sum 2 zeta omega (M phi)(M phi)ᵀ."""
    M, K = body.M.toarray(), body.K.toarray()
    A = Ports.of_body(body).A.toarray()
    D = np.zeros_like(K)
    if damping:
        omega2, Phi = la.eigh(K, M)
        elastic = omega2 > 1.0
        D = 2 * damping * (M @ Phi[:, elastic] * np.sqrt(omega2[elastic])) @ (M @ Phi[:, elastic]).T
    w = 2 * np.pi * np.asarray(frequencies)
    return np.array([A @ np.linalg.solve(K + 1j * wk * D - wk**2 * M, A.T) for wk in w])


def assert_same_response(H, wanted, rtol):
    size = np.abs(wanted).max(axis=(1, 2), keepdims=True)
    assert_allclose(H / size, wanted / size, rtol=0, atol=rtol)


@pytest.mark.parametrize("damping", [0.0, 0.02])
def test_the_reference_agrees_with_a_dense_solve_at_every_frequency(body, reference, damping):
    found = modal_response(reference.response.model, FREQUENCIES, damping=damping)
    assert_same_response(found.H, dense_response(body, FREQUENCIES, damping), 3 * RESPONSE_TOLERANCE)


def test_the_estimated_error_of_the_reference_is_no_less_than_its_true_one(body):
    with Families(body) as families:
        found = reference_response(families, Ports.of_body(body), 1200.0)
    f = [found.checked_at]
    H, wanted = modal_response(found.model, np.array(f)).H, dense_response(body, f)
    size = np.tile(np.repeat([1.0, body.length], 3), 2)
    error = np.linalg.norm((H - wanted) * np.outer(size, size)) / np.linalg.norm(wanted * np.outer(size, size))
    assert error <= 2 * found.error + 1e-10
    assert found.error < RESPONSE_TOLERANCE


def test_every_kind_of_interface_has_a_port(mixed):
    with FullReference(mixed, band=1500.0) as reference:
        found = modal_response(reference.response.model, FREQUENCIES[:4])
        n = mixed.n_dof
        multipliers = (mixed.dofs[:, 1] < 0).sum()
        assert multipliers == 6
        assert_same_response(found.H, dense_response(mixed, FREQUENCIES[:4]), 3 * RESPONSE_TOLERANCE)
        modes = MODE_SETS["craig-bampton-ir"](reference.families, n_modes=25)
        own = frf(reduce(mixed, modes), FREQUENCIES[:3])
        assert own.H.shape == (3, 18, 18)
        assert n > 100
        size = np.linalg.norm(found.H[:3], axis=(1, 2))
        assert (np.linalg.norm(own.H - found.H[:3], axis=(1, 2)) < 1e-3 * size).all()


TURNED = TisserandFrame(origin=(0.4, 0.0, 0.1), axes=((0, 1, 0), (0, 0, 1), (1, 0, 0)))


@pytest.mark.parametrize("frame", [TisserandFrame(), NodalFrame("left"), NodalFrame(), TURNED], ids=str)
@pytest.mark.parametrize("damping", [None, 0.03])
def test_the_response_of_a_file_does_not_depend_on_its_frame(body, frame, damping):
    reduced = reduce(body, unit_set(body), frame=frame)
    found = frf(reduced, FREQUENCIES, damping=damping)
    assert_same_response(found.H, dense_response(body, FREQUENCIES, damping or 0.0), 1e-6)


def test_direct_solution_and_sum_of_modes_of_a_file_agree(body):
    reduced = reduce(body, craig_bampton(body, n_modes=4), damping=ModalDamping(0.01))
    # in mean axes the modes of the file are the free-free ones, so its D is the same damping
    own, summed = (frf(reduced, FREQUENCIES, damping=d) for d in (None, 0.01))
    assert_same_response(own.H, summed.H, 1e-9)


def test_a_mode_set_and_its_file_have_the_same_ports(body, reference):
    modes = craig_bampton(body, n_modes=4)
    from_set = basis_ports(reference, free_basis(body, modes, reference.families))
    from_file = port_model(reduce(body, modes, frame=NodalFrame("right")))
    f = FREQUENCIES
    assert_same_response(modal_response(from_file, f).H, modal_response(from_set, f).H, 1e-7)


def test_low_frequencies_see_the_mass(body):
    found = frf(reduce(body, craig_bampton(body, n_modes=2)), np.array([1e-3]))
    driven = found.between("left", "left")
    assert_allclose(driven.inertance[0, 0, 0].real, 1 / 15.7, rtol=1e-6)
    assert_allclose(driven.mobility[0, 0, 0], driven.H[0, 0, 0] * 2j * np.pi * 1e-3, rtol=1e-12)
    assert driven.outputs == tuple(f"left {c}" for c in ("ux", "uy", "uz", "rx", "ry", "rz"))


def test_the_response_is_reciprocal(body):
    found = frf(reduce(body, craig_bampton(body, n_modes=5), damping=ModalDamping(0.02)), FREQUENCIES)
    assert_allclose(found.H, found.H.transpose(0, 2, 1), rtol=0, atol=1e-10 * np.abs(found.H).max())
    there, back = found.between("left", "right"), found.between("right", "left")
    assert_allclose(there.H, back.H.transpose(0, 2, 1), rtol=0, atol=1e-10 * np.abs(found.H).max())


def test_frequencies_are_in_hertz_in_every_time_unit():
    mesh = box_mesh(3, 1, 1, 100.0, 10.0, 10.0, "hexahedron")
    ends = [Interface(n, "rigid", mesh.node_sets[n], np.array([x, 5.0, 5.0])) for n, x in (("left", 0), ("right", 100))]
    from fe_models.body.material import Material

    peaks_of = []
    for name, E, rho in (("mm-t-s", 210000.0, 7.85e-9), ("mm-g-ms", 210000.0, 7.85e-3)):
        steel = Material("steel", E=E, nu=0.3, rho=rho)
        body = couple(solid_body(mesh, steel, name="b", units=unit_system(name), interfaces=ends))
        with FullReference(body, band=12000.0) as reference:
            comparison = response_comparison(
                reference, port_model(reduce(body, craig_bampton(body, n_modes=12), damping=ModalDamping(0.01)))
            )
        H = comparison.full.H[:, 8, 2]
        peaks_of.append(comparison.full.frequencies[np.argmax(np.abs(H) * comparison.full.frequencies**2)])
        assert comparison.mean_error < 0.2
    assert_allclose(peaks_of[0], peaks_of[1], rtol=1e-9)


def test_the_error_of_a_response_falls_with_more_modes(body, reference):
    errors = []
    for n_modes in (0, 8, 16):  # 6 are all bending, and torsion counts
        modes = MODE_SETS["craig-bampton-ir"](reference.families, n_modes=n_modes)
        model = basis_ports(reference, free_basis(body, modes, reference.families))
        errors.append(response_comparison(reference, model).mean_error)
    assert errors[0] > 5 * errors[1] > 25 * errors[2]


def test_the_relative_error_of_a_scaled_response_is_its_scale(body):
    full = frf(reduce(body, craig_bampton(body, n_modes=2)), FREQUENCIES)
    import dataclasses

    off = dataclasses.replace(full, H=1.25 * full.H)
    assert_allclose(compare_responses(full, off, 0.7), 0.25, rtol=1e-12)


def test_peaks_are_the_natural_frequencies(body):
    reduced = reduce(body, craig_bampton(body, n_modes=4), damping=ModalDamping(0.002))
    f = frequency_grid(50.0, 2000.0, 4000)
    found = frf(reduced, f).between("left", "left")
    top = sorted(p for p, _ in peaks(f, np.abs(found.H[:, 2, 2]))[:1])
    assert np.abs(reduced.free_frequencies / top[0] - 1).min() < 2e-3


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda r: frf(r, np.array([0.0, 1.0])), "frequencies above 0"),
        (lambda r: frf(r, np.array([1.0]), damping=-0.1), "expected a ratio of 0 or more"),
        (
            lambda r: frf(r, np.array([1.0])).between("left", "rigt"),
            "no interface 'rigt'; did you mean 'right'",
        ),
        (lambda r: frequency_grid(10.0, 5.0), "expected 0 < lowest < highest"),
        (lambda r: frequency_grid(1.0, 5.0, 1), "expected 2 to 1000000 frequencies"),
    ],
)
def test_bad_requests_are_refused_in_one_message(body, call, words):
    with pytest.raises(QualityError, match=words):
        call(reduce(body, craig_bampton(body, n_modes=1)))


def test_the_reference_is_not_used_beyond_its_band(body, reference):
    model = port_model(reduce(body, craig_bampton(body, n_modes=1)))
    with pytest.raises(QualityError, match="make the reference for a wider band"):
        response_comparison(reference, model, frequencies=np.array([100.0, 9000.0]))


def test_plots_show_every_curve_with_its_values(body):
    found = frf(reduce(body, craig_bampton(body, n_modes=2)), FREQUENCIES).between("left", "right")
    ax = plot_frf({"a": found, "b": found}, 2, 2)
    assert [line.get_label() for line in ax.get_lines()] == ["a", "b"]
    assert_allclose(ax.get_lines()[0].get_ydata(), np.abs(found.H[:, 2, 2]), rtol=0)
    figure = frf_figure({"a": found}, [(0, 0), (2, 4)], ["one", "two"], is_inertance=True, title="t")
    assert [ax.get_ylabel() for ax in figure.axes] == ["one", "two", "phase [deg]", "phase [deg]"]


# Points around resonances --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("own", [False, True], ids=["ratio", "the file's D"])
@pytest.mark.parametrize("damping", [1e-4, 1e-3, 1e-2])
def test_peaks_have_their_height_however_narrow_they_are(body, damping, own):
    """Against a scan of each peak a thousand times finer than its width; the even grid alone misses most of it."""
    reduced = reduce(body, craig_bampton(body, n_modes=6), damping=ModalDamping(damping))
    asked = None if own else damping
    f, zeta = file_resonances(reduced, damping=asked)
    assert_allclose(f, reduced.free_frequencies, rtol=1e-8)
    even = frequency_grid(10.0, 3000.0)
    grid = resonance_grid(even, f, zeta)
    assert np.isin(even, grid).all()
    assert (np.diff(grid) > 0).all()
    lost = []
    for f_k, zeta_k in zip(f[f < 3000], zeta[f < 3000], strict=True):
        fine = f_k * (1 + zeta_k * np.linspace(-1, 1, 2001))
        true = largest_response(reduced, fine, asked)
        if true == largest_response(reduced, fine[[0, -1]], asked):
            continue  # on the flank of another peak
        near = grid[(grid >= fine[0]) & (grid <= fine[-1])]
        assert largest_response(reduced, near, asked) >= 0.999 * true
        coarse = even[(even > 0.99 * f_k) & (even < 1.01 * f_k)]
        lost.append(1 - largest_response(reduced, coarse, asked) / true)
    assert (max(lost) > 0.5) == (damping < 5e-3)


def largest_response(reduced, frequencies, damping):
    return np.abs(frf(reduced, frequencies, damping=damping).H).max()


def test_an_undamped_resonance_is_approached_and_left_out():
    grid = resonance_grid(np.array([1.0, 100.0]), np.array([10.0, 1e3]), np.zeros(2))
    assert 10.0 not in grid
    assert len(grid) == 2 + 22
    assert (np.abs(grid[1:-1] / 10 - 1) <= 1.2e-3 * (1 + 1e-9)).all()

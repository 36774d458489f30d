"""Beams made of functions along their axis, against closed forms and against finite elements."""

import numpy as np
import pytest
import scipy.linalg as la
from numpy.polynomial import Polynomial
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from cms.errors import BodyError, ModeSetError
from cms.modes.mode_sets.axis_functions import AXIS_FUNCTIONS

STEEL = fm.Material("steel", E=2.0e11, nu=0.3, rho=7870.0)
UNITS = cms.unit_system("m-kg-s")
LENGTH = 1.0
SECTION = fm.beams.Rectangle(0.03, 0.02)
CLAMPED_FREE = (1.8751040687, 4.6940911330, 7.8547574382)
FREE_FREE = (4.7300407449, 7.8532046241, 10.9956078380)


def slender(**changes):
    """Bending without rotary inertia to speak of, no shear: Euler and Bernoulli's beam."""
    values = {"rho_A": 2.0, "EA": 1e7, "EIy": 30.0, "EIz": 50.0, "GJ": 20.0, "rho_Iy": 1e-9, "rho_Iz": 1e-9} | changes
    return fm.beams.BeamLine(LENGTH, **values)


def made(line, n=8, **options):
    values = {"n_axial": 3, "n_bending": n, "n_torsion": 3} | options
    return cms.reduction.beam_from_assumed_modes(line, name="beam", units=UNITS, **values)


@pytest.mark.parametrize("functions", AXIS_FUNCTIONS)
@pytest.mark.parametrize(
    ("frame", "roots"), [(cms.TisserandFrame(), FREE_FREE), (cms.NodalFrame("start"), CLAMPED_FREE)]
)
def test_frequencies_are_those_of_the_free_and_of_the_clamped_beam(functions, frame, roots):
    line = slender(EIy=50.0, EIz=200.0)
    body = made(line, 16 if functions == "splines" else 9, functions=functions, frame=frame, n_axial=6, n_torsion=3)
    for EI in (50.0, 200.0):
        exact = np.array(roots[:2]) ** 2 / LENGTH**2 * np.sqrt(EI / 2.0) / (2 * np.pi)
        found = [min(body.frequencies, key=lambda f, e=e: abs(f - e)) for e in exact]
        assert_allclose(found, exact, rtol=2e-4 if functions == "splines" else 2e-5)


def test_families_of_polynomials_span_the_same_space():
    bodies = [made(slender(), 5, functions=functions) for functions in ("legendre", "monomials")]
    assert_allclose(bodies[0].frequencies, bodies[1].frequencies, rtol=1e-9)
    assert_allclose(bodies[0].moments.S_kl, bodies[1].moments.S_kl, rtol=0, atol=1e-8)


def fine_body(frame, n_modes, n):
    """The same functions on a mesh of n beam elements."""
    mesh = fm.beams.straight_line((0, 0, 0), (LENGTH, 0, 0), n)
    item = fm.beams.BeamProperty(SECTION, STEEL, orientation=(0, 1, 0), shear=False)
    ends = [
        fm.beams.line_interface(mesh, e, fm.beams.NodeIndices((k,)))
        for e, k in (("start", 0), ("mid", n // 2), ("end", n))
    ]
    body = cms.couple(fm.beam_body(mesh, item, name="beam", units=UNITS, interfaces=ends))
    options = {"n_axial": 3, "n_bending": n_modes, "n_torsion": 2, "axis": (1, 0, 0), "point": (0, 0, 0)}
    return cms.reduce(body, cms.modes.assumed_modes(body, **options), frame=frame, geometric=True)


def distances(body, fine):
    """Differences of all that enters the equations of motion, each by the largest number of its kind."""
    Psi, Psi_fine = (np.vstack([i.Psi for i in b.interfaces]) for b in (body, fine))
    sign = np.sign(np.einsum("rk,rk->k", Psi, Psi_fine))
    a, b = body.moments, fine.moments
    pairs = {
        "frequencies": (body.frequencies, fine.frequencies),
        "interfaces": (Psi * sign, Psi_fine),
        "1C": (a.C1 * sign, b.C1),
        "P": (a.P * sign, b.P),
        "2C": (a.C2 * sign, b.C2),
        "S": (a.S_kl * sign * sign[:, None], b.S_kl),
    } | {
        f"geometric {name}": (getattr(body.geometric, name) * sign * sign[:, None], getattr(fine.geometric, name))
        for name in ("translation", "rotation", "spin", "interfaces")
    }
    unit = np.sqrt(a.m) * LENGTH
    floor = {"1C": unit / LENGTH, "P": unit, "2C": unit}  # zero in mean axes, as geometric translation
    return {
        name: np.abs(found - exact).max() / max(np.abs(exact).max(), floor.get(name, 1e-3))
        for name, (found, exact) in pairs.items()
    }


@pytest.mark.parametrize("frame", [cms.TisserandFrame(), cms.NodalFrame("start")], ids=["free", "clamped"])
def test_a_mesh_of_beam_elements_converges_to_the_integrals_without_a_mesh(frame):
    """With h², that of the linear elements of tension and torsion."""
    line = fm.beams.beam_line(LENGTH, fm.beams.BeamProperty(SECTION, STEEL, shear=False))
    body = made(line, 5, frame=frame, n_torsion=2, stations={"start": 0.0, "mid": 0.5, "end": LENGTH})
    coarse, fine = (fine_body(frame, 5, n) for n in (30, 90))
    assert body.n_q == fine.n_q
    assert_allclose(body.frame.origin, fine.frame.origin, rtol=0, atol=1e-12)
    a, b = body.moments, fine.moments
    assert_allclose([a.m, *a.S, *a.R.ravel()], [b.m, *b.S, *b.R.ravel()], rtol=1e-10, atol=1e-12)
    before, after = distances(body, coarse), distances(body, fine)
    for name, distance in after.items():
        assert distance < 1e-3, name
        assert distance < 0.13 * before[name] + 1e-9, name  # 1/9 and what is of higher order


def test_mean_axes_carry_no_momentum_of_the_modes_and_the_mass_is_that_of_the_modes():
    body = made(fm.beams.beam_line(LENGTH, fm.beams.BeamProperty(SECTION, STEEL)), 4)
    moments = body.moments
    assert_allclose(moments.C1, 0, rtol=0, atol=1e-11)
    assert_allclose(moments.C2, 0, rtol=0, atol=1e-11)
    assert_allclose(moments.M, np.eye(body.n_q), rtol=0, atol=1e-10)


def test_shear_gives_the_frequencies_of_the_timoshenko_beam():
    item = fm.beams.BeamProperty(fm.beams.Rectangle(0.08, 0.1), STEEL)
    body = made(fm.beams.beam_line(LENGTH, item), 9, n_axial=4, n_torsion=4)
    mesh = fm.beams.straight_line((0, 0, 0), (LENGTH, 0, 0), 100)
    fine = cms.couple(
        fm.beam_body(
            mesh,
            fm.beams.BeamProperty(item.section, STEEL, orientation=(0, 1, 0)),
            name="beam",
            units=UNITS,
            interfaces=[fm.beams.line_interface(mesh, "start", fm.beams.NodeIndices((0,)))],
        )
    )
    full = cms.reduce(fine, cms.modes.normal_modes(fine, n_modes=8)).free_frequencies
    assert_allclose(body.free_frequencies[:6], full[:6], rtol=4e-4)
    stiff = made(
        fm.beams.beam_line(LENGTH, fm.beams.BeamProperty(item.section, STEEL, shear=False)), 9, n_axial=4, n_torsion=4
    )
    assert stiff.free_frequencies[2] > 1.02 * full[2]


def cone_line(d_start, d_end):
    """Laws of a round cone as polynomials."""
    d = Polynomial([d_start, (d_end - d_start) / LENGTH])
    A, inertia = np.pi / 4 * d**2, np.pi / 64 * d**4
    E, G = STEEL.E, STEEL.E / (2 * (1 + STEEL.nu))
    mass = STEEL.rho * inertia
    return fm.beams.BeamLine(
        LENGTH, STEEL.rho * A, E * A, E * inertia, E * inertia, 2 * G * inertia, rho_Iy=mass, rho_Iz=mass
    )


def test_tapered_cantilever_deflects_as_the_closed_form_says():
    """Round cone, force at the thin end: P L³ / (3 E I_thin) (d_thin / d_thick)³; tension 4 P L / (pi E d d')."""
    thick, thin = 0.06, 0.03
    body = made(cone_line(thick, thin), 14, n_axial=10, frame=cms.NodalFrame("start"))
    Psi = body.interface("end").Psi
    compliance = Psi @ np.diag(1 / np.diag(body.K)) @ Psi.T
    I_thin = np.pi / 64 * thin**4
    assert_allclose(compliance[1, 1], LENGTH**3 / (3 * STEEL.E * I_thin) * (thin / thick) ** 3, rtol=1e-7)
    assert_allclose(compliance[0, 0], 4 * LENGTH / (np.pi * STEEL.E * thin * thick), rtol=1e-7)
    assert_allclose(body.moments.m, STEEL.rho * np.pi / 12 * (thick**2 + thick * thin + thin**2) * LENGTH, rtol=1e-12)


def test_laws_of_sections_along_the_beam_are_those_of_the_polynomials():
    def section(x):
        return fm.beams.Circle((0.06 - 0.03 * x / LENGTH) / 2)

    line = fm.beams.beam_line(LENGTH, fm.beams.BeamProperty(section(0.0), STEEL, shear=False), taper=section)
    exact, x = cone_line(0.06, 0.03), np.linspace(0, LENGTH, 7)
    for name in ("rho_A", "EA", "EIy", "EIz", "GJ", "rho_Iy", "rho_Iz"):
        assert_allclose(line.at(name, x), exact.at(name, x), rtol=1e-12)
    assert_allclose(made(line, 5).frequencies, made(exact, 5).frequencies, rtol=1e-9)


def test_a_stepped_beam_is_integrated_piece_by_piece():
    def EA(x):
        return np.where(x < 0.3, 1e7, 3e7)

    line = slender(EA=EA, breaks=(0.3,))
    x, weight = line.points(0)
    assert_allclose(weight @ EA(x), 0.3e7 + 2.1e7, rtol=1e-12)


def test_modal_file_keeps_the_body(tmp_path):
    body = made(slender(), 4)
    cms.write(body, tmp_path / "beam.h5")
    again = cms.read(tmp_path / "beam.h5")
    np.testing.assert_array_equal(again.moments.S_kl, body.moments.S_kl)
    assert again.labels == body.labels


def test_a_nodal_frame_at_the_chord_holds_its_ends():
    chord = cms.NodalFrame(dofs=((0, 0), (0, 1), (0, 2), (0, 3), (1, 1), (1, 2)))
    body = made(slender(), 4, frame=chord)
    start, end = body.interface("start").Psi, body.interface("end").Psi
    for held in (start[:4], end[1:3]):
        assert_allclose(held, 0, rtol=0, atol=1e-11 * np.abs(end).max())


@pytest.mark.parametrize(
    ("options", "error", "text"),
    [
        ({"functions": "legendr"}, ModeSetError, "did you mean 'legendre'"),
        ({"n_axial": -1}, ModeSetError, "n_axial = -1"),
        ({"n_axial": 0, "n_bending": 0, "n_torsion": 0}, ModeSetError, "at least one function"),
        ({"n_shear": 2}, ModeSetError, "rigid in shear"),
        ({"stations": {"tip": 1.5}}, BodyError, "station 'tip': expected a position in 0 .. 1"),
        ({"stations": {}}, BodyError, "at least one station"),
        ({"frame": cms.NodalFrame("stat")}, BodyError, "no station 'stat'"),
        ({"frame": cms.reduction.BuckensFrame()}, BodyError, "no Buckens frame"),
    ],
)
def test_bad_options_are_refused(options, error, text):
    with pytest.raises(error, match=text):
        made(slender(), **({"n_bending": 3} | options))


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"EA": -1.0}, "EA: expected positive numbers"),
        ({"rho_A": lambda x: x - 0.5}, "rho_A: expected positive"),
        ({"rho_Iy": 0.0, "rho_Iz": 0.0}, "no moment of inertia about x"),
        ({"breaks": (2.0,)}, "breaks: expected ascending"),
    ],
)
def test_impossible_laws_are_refused(changes, text):
    with pytest.raises(BodyError, match=text):
        made(slender(**changes), 3)


def test_a_section_beside_its_shear_centre_is_refused():
    item = fm.beams.BeamProperty(fm.beams.GeneralSection(1e-3, 1e-7, 1e-7, 1e-8, shear_center=(0.01, 0.0)), STEEL)
    with pytest.raises(fm.errors.SectionError, match="shear centre"):
        fm.beams.beam_line(1.0, item)
    with pytest.raises(fm.errors.SectionError, match="offset and orientation"):
        fm.beams.beam_line(1.0, fm.beams.BeamProperty(SECTION, STEEL, offset=(0.1, 0.0)))


def test_a_pinned_column_buckles_at_the_load_of_euler():
    """P = pi² EI / L²: unit force at the end along x, supported at the chord."""
    chord = cms.NodalFrame(dofs=((0, 0), (0, 1), (0, 2), (0, 3), (1, 1), (1, 2)))
    body = made(slender(EIy=30.0, EIz=50.0), 8, frame=chord)
    K_geo = body.geometric.interfaces[1, 0]
    least = 1 / la.eigh(K_geo, body.K, eigvals_only=True)[-1]
    assert_allclose(least, np.pi**2 * 30.0 / LENGTH**2, rtol=1e-6)


def test_a_body_without_geometric_stiffness_can_be_had():
    assert made(slender(), 3, geometric=False).geometric is None


def test_torsion_and_shear_without_rotary_inertia_are_refused_in_words():
    plain = slender(rho_Iy=0.0, rho_Iz=0.0)
    held = cms.NodalFrame("start")
    with pytest.raises(BodyError, match=r"n_torsion = 3, but the sections have no moment of inertia about x"):
        made(plain, frame=held)
    with pytest.raises(BodyError, match=r"n_shear = 9, but the sections have no rotary inertia"):
        made(slender(rho_Iy=0.0, rho_Iz=0.0, GAy=1e5, GAz=1e5), frame=held, n_torsion=0)
    with pytest.raises(BodyError, match="a Tisserand frame needs one"):
        made(plain, n_torsion=0)
    body = made(plain, frame=held, n_torsion=0)
    first = CLAMPED_FREE[0] ** 2 * np.sqrt(30.0 / 2.0) / (2 * np.pi)
    assert_allclose(body.frequencies[0], first, rtol=1e-6)

"""A fatigue file from end to end: units, factors, blocks, pages and tables; every fault in one message."""

import csv
import json
from dataclasses import replace

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.body.modal_file.file import write
from floatframe import read_results
from floatframe.durability.fatigue import assess, basquin_curve, equivalent_repeats, history_damage, read_fatigue
from floatframe.durability.fatigue.criteria import Criterion
from floatframe.durability.fatigue.load_blocks import LoadBlock, block_of_results
from floatframe.durability.fatigue.mean_stress import MeanStress
from floatframe.durability.fatigue.planes import surface_frames, surface_nodes
from floatframe.durability.fatigue.report import cycles_at, exceedances
from floatframe.durability.fatigue.spectral.spectra import spectra_of_history
from floatframe.durability.fatigue.surface_damage import spectral_damage
from floatframe.errors import FatigueError
from tests.floatframe.command import answer_of_floatframe
from tests.floatframe.results.examples import BODY, TEXT

FATIGUE = """
body = "part.h5"

[material]
stress_unit = "MPa"
tensile_strength = {strength}
[material.sn]
amplitude = {amplitude}
cycles = 1e6
slope = 5.0
least_cycles = 1.0
log_deviation = 0.2

[criterion]
mean_stress = "goodman"

[counting]
negligible = 0.0

[programme]
amount = 30.0
unit = "km"

[[blocks]]
name = "spin"
results = "spin.h5"
body = "{body}"
repeats = 40
"""
FLEXIBLE = "part"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A motion, its modal file, and a curve through the greatest stress of the motion at a thousand cycles."""
    path = tmp_path_factory.mktemp("fatigue")
    write(BODY, path / "part.h5")
    (path / "spin.toml").write_text(TEXT)
    answer_of_floatframe("run", path / "spin.toml")
    return path


@pytest.fixture(scope="module")
def amplitude(folder):
    """An amplitude at which the worst node lives some thousand passes [MPa]."""
    motion = read_results(folder / "spin.h5")
    block = block_of_results(motion, name_of(motion))
    found = history_damage(BODY, [block], basquin_curve(1.0, 1e6, 5, least_cycles=1), extrapolate=True)
    return 0.999 * float(found.largest.max())  # so that the largest cycle lies beyond the knee by more than rounding


def name_of(motion):
    return next(body.name for body in motion.head.bodies if body.n_q)


@pytest.fixture
def file(folder, amplitude):
    path = folder / "job.toml"
    text = FATIGUE.format(amplitude=amplitude, strength=100 * amplitude, body=name_of(read_results(folder / "spin.h5")))
    path.write_text(text)
    return path


def changed(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_the_file_is_what_python_says(file, folder, amplitude):
    made = assess(read_fatigue(file))
    motion = read_results(folder / "spin.h5")
    block = LoadBlock("spin", motion.body(name_of(motion)).q, motion.t, 40)
    expected = history_damage(
        BODY, [block], basquin_curve(amplitude, 1e6, 5, least_cycles=1), negligible=0,
        mean_stress=MeanStress("goodman", 100 * amplitude),
    )  # fmt: skip
    assert_allclose(made.result.damage, expected.damage, rtol=1e-12)
    assert_allclose(made.life, 30 / expected.damage, rtol=1e-12)
    assert (made.result.damage[made.result.worst(3)] == np.sort(made.result.damage)[::-1][:3]).all()


def test_numbers_that_a_file_does_not_give_are_those_of_python(file):
    """Of the page: Findley's k 0.3, 18 angles; in the file and in Python alike."""
    changed(file, "[criterion]", '[criterion]\nname = "findley"')
    section, plain = read_fatigue(file).criterion, Criterion("findley")
    assert (section.findley_k, section.planes) == (plain.findley_k, plain.n_planes) == (0.3, 18)


@pytest.mark.parametrize(
    ("name", "valid", "invalid"), [("planes", (4, 360), (3, 361)), ("findley_k", (0, 2), (-0.01, 2.01))]
)
def test_numbers_of_a_criterion_are_taken_up_to_their_bounds(file, name, valid, invalid):
    text = file.read_text()
    for value in (*valid, *invalid):
        file.write_text(text.replace("[criterion]", f"[criterion]\n{name} = {value}"))
        if value in valid:
            assert getattr(read_fatigue(file).criterion, name) == value
        else:
            with pytest.raises(ValueError, match=name):
                read_fatigue(file)


@pytest.mark.parametrize("unit", ["Pa", "psi", "ksi", "N/mm^2", "GPa"])
def test_the_unit_of_the_curve_does_not_change_the_damage(file, amplitude, unit):
    before = assess(read_fatigue(file)).result.damage
    size = {"Pa": 1e6, "psi": 1 / 6894.757293168361e-6, "ksi": 1 / 6.894757293168361, "N/mm^2": 1, "GPa": 1e-3}[unit]
    changed(file, '"MPa"', f'"{unit}"')
    changed(file, f"amplitude = {amplitude}", f"amplitude = {amplitude * size!r}")
    changed(file, f"tensile_strength = {100 * amplitude}", f"tensile_strength = {100 * amplitude * size!r}")
    assert_allclose(assess(read_fatigue(file)).result.damage, before, rtol=1e-9)


def test_factors_and_ranges_by_hand(file, amplitude):
    """Amplitudes times 0.8 x 0.5, cycles at two standard deviations; k = 5, no mean stress."""
    changed(file, 'mean_stress = "goodman"', 'mean_stress = "none"')
    before = assess(read_fatigue(file)).result.damage
    changed(file, f"amplitude = {amplitude}", f"range = {2 * amplitude!r}")
    changed(
        file,
        'body = "part.h5"',
        'body = "part.h5"\nsurvival = 0.9772498680518208\nfactors = {surface = 0.8, size = 0.5}',
    )
    assert_allclose(assess(read_fatigue(file)).result.damage, before * 10**0.4 / 0.4**5, rtol=1e-9)


def test_what_is_written_holds_the_same_numbers(file, folder):
    made = assess(read_fatigue(file))
    text = answer_of_floatframe("fatigue", file)
    worst = int(made.result.worst()[0])
    name = BODY.node_name(int(made.result.nodes[worst]))
    assert name in text
    record = json.loads((folder / "job.json").read_text())
    assert {name: part for name, part in record.items() if name != "table"} == json.loads(
        answer_of_floatframe("fatigue", file, "--json")
    )
    assert record["worst"][0]["node"] == name
    assert_allclose(record["worst"][0]["life"], 30 / made.result.damage[worst], rtol=1e-12)
    with open(folder / "job.csv", newline="") as table:
        rows = list(csv.DictReader(table))
    assert_allclose([float(row["damage"]) for row in rows], made.result.damage[made.result.worst(20)], rtol=1e-15)
    surface = meshio.read(folder / "job.vtu")
    at = made.result.nodes >= 0  # the others are stress points, which show at a node if they are worse
    assert_allclose(surface.point_data["damage"][made.result.nodes[at]], made.result.damage[at], rtol=1e-15)
    assert_allclose(surface.points, BODY.frame.origin + BODY.nodes @ BODY.frame.axes.T, atol=1e-12)
    page = (folder / "job.html").read_text()
    assert f"node {name}, lasts {record['life']:.4g} km" in page
    assert "http://" not in page.split("<script>")[0]


def test_the_cycles_of_a_place_do_its_damage(file):
    made = assess(read_fatigue(file))
    place = int(made.result.worst()[0])
    cycles = cycles_at(made.result, made.blocks, place)
    assert_allclose(cycles[:, 2] @ made.result.curve.damage(cycles[:, 0]), made.result.damage[place], rtol=1e-12)
    count, S = exceedances(cycles, n_points=10_000)
    assert_allclose(count[-1], cycles[cycles[:, 0] > 0, 2].sum())
    assert (np.diff(S) <= 0).all()


def test_spectra_of_a_file(file, folder, amplitude):
    rng = np.random.default_rng(0)
    t = np.arange(4096) / 100
    spectra = spectra_of_history("noise", t, rng.standard_normal((4096, BODY.n_q)), n_segment=256)
    np.savez(folder / "noise.npz", frequencies=spectra.frequencies, spectra=spectra.spectra)
    text = file.read_text().partition("[[blocks]]")[0]
    (folder / "noise.toml").write_text(text + '[[spectra]]\nfile = "noise.npz"\nduration = 60.0\nscale = 1e-5\n')
    made = assess(read_fatigue(folder / "noise.toml"))
    curve = basquin_curve(amplitude, 1e6, 5, least_cycles=1)
    expected = spectral_damage(BODY, [replace(spectra, duration=60.0, scale=1e-5, mean=None)], curve, extrapolate=True)
    assert_allclose(made.result.damage, expected.damage, rtol=1e-12)
    assert "spectral, dirlik" in answer_of_floatframe("fatigue", folder / "noise.toml", "--json")
    (folder / "noise.toml").write_text(text + '[[spectra]]\nfile = "noise.npz"\n')
    assert "the duration is not known" in answer_of_floatframe("fatigue", folder / "noise.toml", code=2)
    np.savez(folder / "noise.npz", spectra=spectra.spectra)
    assert "frequencies missing" in answer_of_floatframe("fatigue", folder / "noise.toml", code=2)


def test_a_measured_event_is_so_many_passes():
    """Twice the signal, and every cycle three times: 3 x 2^5."""
    simulated = np.sin(np.arange(400) * 2 * np.pi / 40)
    assert_allclose(equivalent_repeats(2 * np.tile(simulated, 3), simulated, 5.0), 96, rtol=1e-9)
    with pytest.raises(FatigueError, match="does not vary"):
        equivalent_repeats(simulated, np.ones(5), 5.0)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"MPa"', '"MPA"', "unknown stress unit; did you mean 'MPa'"),
        ("cycles = 1e6\n", "", "cycles: missing; expected the cycles of the knee"),
        ("slope = 5.0\n", "", "expected cycles, slope, and either amplitude or range"),
        ("slope = 5.0\n", "slope = 0.5\n", "material.sn.slope = 0.5: expected a number of 1 or more"),
        ("slope = 5.0\n", "amplitudes = [3.0, 2.0]\n", "got parts of both"),
        ("tensile_strength", "yield_strength", "needs material.tensile_strength, which is missing"),
        ("tensile_strength = ", "tensile_strength = 0.0 # ", "material.tensile_strength = 0.0: expected"),
        ('"goodman"', '"goodmann"', "unknown mean stress correction; did you mean 'goodman'"),
        ("log_deviation = 0.2", "survival = 0.9", ""),
        ('body = "part.h5"', 'body = "part.h6"', "no such file"),
        ('results = "spin.h5"', 'results = "spun.h5"', "no such file"),
        ("repeats = 40", "repeats = 0", "blocks.0.repeats = 0"),
        ("repeats = 40", "times = [5.0, 6.0]", "expected at least two output times"),
        ("repeats = 40", "scale = 0.0", "scale: expected a number other than 0"),
        ("repeats = 40", 'body_name = "x"', "unknown key"),
        ("cycles = 1e6\nslope = 5.0\nleast_cycles = 1.0", "cycles = []\namplitudes = []", "expected a table (cycles"),
        ('results = "spin.h5"', 'results = "part.h5"', "expected a results-file, got a modal-file"),
        ("least_cycles = 1.0", "least_cycles = 1e6", "lie beyond the S-N curve, which is known up to"),
    ],
)  # fmt: skip
def test_faults_of_the_file_are_named(file, old, new, words):
    changed(file, old, new)
    if words:
        assert words in answer_of_floatframe("fatigue", file, code=2)
    else:
        assert read_fatigue(file).material.sn.survival == 0.9


def test_blocks_and_spectra_together_are_refused(file):
    text = file.read_text().partition("[[blocks]]")[0]
    file.write_text(text)
    assert "expected [[blocks]] or [[spectra]], got neither" in answer_of_floatframe("fatigue", file, code=2)


def test_cycles_beyond_the_curve_are_told_when_they_are_counted(file):
    changed(file, "least_cycles = 1.0", "least_cycles = 1e6")
    changed(file, "negligible = 0.0", "extrapolate = true")
    made = assess(read_fatigue(file))
    assert (made.result.beyond > 0).any()
    assert any("its first slope was continued" in note for note in made.result.notes)


def test_a_strength_that_is_reached_is_refused_even_when_extrapolating(file, amplitude):
    changed(file, f"tensile_strength = {100 * amplitude}", f"tensile_strength = {1e-6 * amplitude}")
    changed(file, "negligible = 0.0", "extrapolate = true")
    assert "the mean stress of a cycle is no less than the strength" in answer_of_floatframe("fatigue", file, code=2)


def test_another_modal_file_than_that_of_the_run_is_refused(file, folder):
    write(replace(BODY, stress=2 * BODY.stress), folder / "other.h5")
    changed(file, 'body = "part.h5"', 'body = "other.h5"')
    assert "was computed with another modal file" in answer_of_floatframe("fatigue", file, code=2)


def test_a_body_without_stress_or_surface_says_so():
    with pytest.raises(FatigueError, match="stress = true in"):
        surface_nodes(replace(BODY, stress=None))
    with pytest.raises(FatigueError, match="no surface at its nodes"):
        surface_frames(replace(BODY, surface=np.zeros((0, 3), int)), np.array([0]))
    with pytest.raises(FatigueError, match="expected kept nodes 0 to 39"):
        history_damage(
            BODY, [LoadBlock("a", np.zeros((3, BODY.n_q)))], basquin_curve(1.0, 1e6, 5), nodes=np.array([40])
        )


def test_normals_of_a_sphere_point_outward():
    import pyvista

    ball = pyvista.Icosphere(nsub=2)
    triangles = ball.faces.reshape(-1, 4)[:, 1:]
    n = ball.n_points
    body = replace(
        BODY, nodes=ball.points, node_ids=np.arange(n), Phi=np.zeros((n, 3, BODY.n_q)), surface=triangles,
        stress=np.zeros((n, 6, BODY.n_q)), interfaces=(), quadratic=None,
    )  # fmt: skip
    frames = surface_frames(body, np.arange(n))
    assert_allclose(frames[:, 2], ball.points / np.linalg.norm(ball.points, axis=1, keepdims=True), atol=0.03)
    assert_allclose(frames @ frames.transpose(0, 2, 1), np.tile(np.eye(3), (n, 1, 1)), atol=1e-12)
    assert_allclose(np.linalg.det(frames), 1, atol=1e-12)


def test_coarse_output_is_told(amplitude):
    q = np.zeros((40, BODY.n_q))
    q[:, 0] = np.resize([1.0, 0, -1, 0], 40)
    found = history_damage(BODY, [LoadBlock("a", q)], basquin_curve(100.0, 1e6, 5, least_cycles=1e-9))
    assert any("4.0 output times a cycle" in note for note in found.notes)
    assert Criterion().name == found.criterion.name


def test_a_motion_in_other_units_than_the_body_does_the_same_damage(file, folder):
    expected = assess(read_fatigue(file)).result.damage
    (folder / "metres.toml").write_text(TEXT.replace('"mm-t-s"', '"m-kg-s"'))
    answer_of_floatframe("run", folder / "metres.toml")
    changed(file, 'results = "spin.h5"', 'results = "metres.h5"')
    assert_allclose(assess(read_fatigue(file)).result.damage, expected, rtol=1e-5)

"""Test and model: tests that were never made, from a model with other constants, and closed forms."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from cms.assessment.correlation import (
    CorrelationError,
    MeasuredModes,
    Pairing,
    Parameter,
    Placement,
    comac,
    correlate_modes,
    fit_damping,
    mac,
    modes_of_body,
    modes_of_file,
    read_mode_table,
    read_universal,
    update_model,
)
from cms.assessment.correlation.correlate import pair_modes
from cms.assessment.correlation.measured import phase_collinearity
from cms.cli import main
from cms.jobs import body_of_job
from cms.jobs.body_of_job import job_body
from cms.jobs.job import read_job
from cms.jobs.studies import correlation_document
from cms.pipeline import reduce_job
from fe_models.files import read_table
from fe_models.foundation.documents.html import html_page
from tests.bodies import box_mesh
from tests.cms.assessment.correlation.synthetic_test import mode_table_text, universal_text, write
from tests.decks import JOB, write_deck

YOUNG, DENSITY = 210000.0, 7.85e-9
STIFFER, LIGHTER = 1.1, 0.95  #: the specimen over the job
N = 6
FILE = """
[model]
job = "bar.toml"

[test]
file = "modes.unv"

[update]
frequency_spread = 0.002

[update.parameters.young]
path = "materials.steel.young"   # the only one that is not known
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A bar, its job, and the job of the specimen."""
    folder = tmp_path_factory.mktemp("test")
    write_deck(folder / "bar.inp", box_mesh(8, 2, 1, 100.0, 20.0, 6.0, kind="hexahedron20"))
    write(folder / "bar.toml", JOB)
    other = JOB.replace("210000", repr(STIFFER * YOUNG)).replace("7.85e-9", repr(LIGHTER * DENSITY))
    write(folder / "specimen.toml", other)
    return folder


@pytest.fixture(scope="module")
def specimen(folder):
    return modes_of_body(job_body(read_job(folder / "specimen.toml")), 30000.0)


@pytest.fixture(scope="module")
def rows(specimen):
    """Every second node of the upper face."""
    return np.flatnonzero(np.isclose(specimen.nodes[:, 2], 6.0))[::2]


@pytest.fixture(scope="module")
def measured(specimen, rows):
    """All three directions, at points that are no nodes by their number."""
    shapes = specimen.shapes[rows][:, :, :N].reshape(-1, N)
    return MeasuredModes(
        specimen.frequencies[:N], shapes, np.repeat(rows + 1000, 3), np.tile(np.eye(3), (len(rows), 1)),
        np.repeat(specimen.nodes[rows], 3, axis=0),
    )  # fmt: skip


@pytest.fixture(scope="module")
def model(folder):
    return modes_of_body(job_body(read_job(folder / "bar.toml")), 30000.0)


def test_modes_of_a_stiffer_and_lighter_bar(measured, model):
    """Shapes are the same, frequencies go with sqrt(E / rho), the mass at the rows makes the shapes orthonormal."""
    found = correlate_modes(measured, model)
    assert [(pair.measured, pair.computed) for pair in found.pairs] == [(k, k) for k in range(N)]
    assert_allclose([pair.mac for pair in found.pairs], 1.0, atol=1e-9)
    assert_allclose(found.errors, np.sqrt(LIGHTER / STIFFER) - 1, rtol=1e-6)
    assert_allclose(found.comac[np.isfinite(found.comac)], 1.0, atol=1e-6)
    assert np.isfinite(found.comac).sum() > 2 * len(found.comac) // 3
    assert_allclose(found.orthogonality, np.eye(N), atol=1e-6)
    assert_allclose(np.abs(found.cross_orthogonality), np.eye(N), atol=1e-6)
    assert found.points.distances.max() < 1e-9


def test_a_correlation_is_a_table_of_measured_modes(measured, model):
    """The second mode has no partner; the others have their frequencies, errors and MAC."""
    found = correlate_modes(measured, model)
    less = replace(found, pairs=tuple(pair for pair in found.pairs if pair.measured != 1))
    frame = less.to_dataframe()
    assert frame.index.tolist() == list(range(1, N + 1))
    assert frame.loc[2, ["computed", "computed frequency", "error", "MAC"]].isna().all()
    paired = frame.drop(index=2)
    assert_allclose(paired["computed frequency"] / paired["measured frequency"] - 1, paired["error"], atol=1e-12)
    assert_allclose(paired["error"], less.errors)
    assert_allclose(paired["MAC"], [pair.mac for pair in less.pairs])
    assert less.to_xarray()["computed frequency"].attrs["units"] == "Hz"


def test_a_turned_sensor_has_the_worst_comac(measured, model, rows):
    shapes = np.array(measured.shapes)
    k = len(rows) // 3
    shapes[3 * k : 3 * k + 3] = -shapes[3 * k : 3 * k + 3] * np.linspace(1, -1, N)
    found = correlate_modes(replace(measured, shapes=shapes), model)
    assert found.point_comac()[0][0] == rows[k] + 1000
    assert found.point_comac()[0][2] < 0.7 < found.point_comac()[1][2]


def test_a_test_in_other_axes_and_units(measured, model):
    """The test lies turned by a quarter about z and shifted; its directions turn with it."""
    A = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # columns: axes of the test in the mesh
    origin = np.array([5.0, -3.0, 2.0])
    turned = replace(
        measured, places=(measured.places - origin) @ A,
        shapes=np.einsum("ab,pak->pbk", A, measured.shapes.reshape(-1, 3, N)).reshape(-1, N),
    )  # fmt: skip
    placement = Placement(tuple(origin), tuple(map(tuple, A.T)))
    assert_allclose([pair.mac for pair in correlate_modes(turned, model, placement=placement).pairs], 1.0, atol=1e-9)
    with pytest.raises(CorrelationError, match="no node within"):
        correlate_modes(turned, model)


def test_points_by_number_by_hand_and_what_is_refused(measured, model, rows):
    named = replace(
        measured, points=np.repeat(model.numbering.nodes[rows], 3), places=np.full((3 * len(rows), 3), np.nan)
    )
    assert len(correlate_modes(named, model, placement=Placement(match="number")).pairs) == N
    with pytest.raises(CorrelationError, match='give match = "number"'):
        correlate_modes(named, model)
    far = np.array(measured.places)
    far[:3] += 50.0
    with pytest.raises(CorrelationError, match=f"farthest is point {rows[0] + 1000}"):
        correlate_modes(replace(measured, places=far), model)
    by_hand = {int(rows[0] + 1000): int(model.numbering.nodes[rows[0]])}
    assert len(correlate_modes(replace(measured, places=far), model, placement=Placement(nodes=by_hand)).pairs) == N
    twice = np.array(measured.places)
    twice[3:6] = twice[:3]
    with pytest.raises(CorrelationError, match="all nearest to node"):
        correlate_modes(replace(measured, places=twice), model)
    with pytest.raises(CorrelationError, match="no point 7"):
        correlate_modes(measured, model, placement=Placement(nodes={7: 1}))


def test_pairs_by_hand_go_first():
    likeness = np.array([[0.9, 0.2, 0.1], [0.3, 0.8, 0.7], [0.1, 0.6, 0.75]])
    f = np.array([1.0, 2.0, 2.1])
    free = pair_modes(f, f, likeness)
    assert [(p.measured, p.computed) for p in free] == [(0, 0), (1, 1), (2, 2)]
    forced = pair_modes(f, f, likeness, by_hand=((1, 2), (0, -1)))
    assert [(p.measured, p.computed, p.by_hand) for p in forced] == [(1, 2, True), (2, 1, False)]
    assert len(pair_modes(f, 3 * f, likeness)) == 0  # outside of the window
    with pytest.raises(CorrelationError, match="stands in another pair"):
        pair_modes(f, f, likeness, by_hand=((1, 2), (1, 0)))
    with pytest.raises(CorrelationError, match="the test has 3 modes"):
        pair_modes(f, f, likeness, by_hand=((7, 0),))


def test_noise_in_a_direction_without_motion_has_no_comac():
    rng = np.random.default_rng(3)
    computed = rng.uniform(0.5, 1.0, (12, 4)) * rng.choice([-1.0, 1.0], (12, 4))
    computed[[2, 7]] *= 1e-3
    noisy = 1.7 * computed + 0.01 * rng.standard_normal((12, 4))
    values = comac(noisy, computed)
    assert np.flatnonzero(np.isnan(values)).tolist() == [2, 7]
    assert np.nanmin(values) > 0.99
    noisy[2, 1] += 0.8  # a sensor that moves where the model does not
    assert comac(noisy, computed)[2] < 0.5


def test_a_point_without_moving_directions_is_not_listed(measured, model, rows):
    found = correlate_modes(measured, model)
    values = np.array(found.comac)
    values[:3], values[3:5] = np.nan, np.nan
    values[5] = 0.5
    listed = replace(found, comac=values).point_comac()
    assert listed[0][::2] == (rows[1] + 1000, 0.5)
    assert rows[0] + 1000 not in [point for point, _, _ in listed]


def test_criteria_against_their_definitions():
    rng = np.random.default_rng(0)
    A, B = rng.standard_normal((12, 3)), rng.standard_normal((12, 3))
    expected = [[(a @ b) ** 2 / (a @ a * (b @ b)) for b in B.T] for a in A.T]
    assert_allclose(mac(A, B), expected)
    assert_allclose(comac(A, -3 * A), 1.0)
    assert (comac(A, B) <= 1 + 1e-12).all()
    x = rng.standard_normal(12)
    shapes = np.column_stack([x * np.exp(0.7j), x + 1j * rng.standard_normal(12)])
    assert phase_collinearity(shapes)[0] == pytest.approx(1.0)
    assert phase_collinearity(shapes)[1] < 0.9


def test_universal_files_of_normal_and_complex_modes(measured, specimen, rows, tmp_path, model):
    shapes = specimen.shapes[rows][:, :, :N]
    zeta = np.linspace(0.004, 0.009, N)
    places = specimen.nodes[rows]
    for phase in (None, 0.4):
        text = universal_text(rows + 1000, places * 1e-3, specimen.frequencies[:N], shapes, zeta, complex_phase=phase)
        found = read_universal(write(tmp_path / "m.unv", text), 1e-3)
        assert_allclose(found.frequencies, specimen.frequencies[:N], rtol=1e-4)
        assert_allclose(found.damping, zeta, rtol=1e-3)
        assert_allclose(found.places, measured.places, atol=1e-9)
        assert_allclose([pair.mac for pair in correlate_modes(found, model).pairs], 1.0, atol=1e-6)
        assert found.collinearity.size == (0 if phase is None else N)
    without = universal_text(rows, places, specimen.frequencies[:N], shapes, zeta, units=None)
    with pytest.raises(CorrelationError, match="nothing tells its unit of length"):
        read_universal(write(tmp_path / "m.unv", without), 1e-3)
    assert_allclose(read_universal(tmp_path / "m.unv", 1e-3, given=1e-3).places, measured.places, atol=1e-9)
    with pytest.raises(CorrelationError, match="says that one length unit is 1 m"):
        read_universal(write(tmp_path / "m.unv", text), 1e-3, given=1e-3)
    local = universal_text(rows, places, specimen.frequencies[:N], shapes, zeta, system=12)
    with pytest.raises(CorrelationError, match=r"displacement systems \[12\]"):
        read_universal(write(tmp_path / "m.unv", local), 1e-3)
    with pytest.raises(CorrelationError, match="the last dataset is cut off"):
        read_universal(write(tmp_path / "m.unv", text[: len(text) // 3]), 1e-3)
    with pytest.raises(CorrelationError, match="expected modes"):
        read_universal(write(tmp_path / "m.unv", universal_text(rows, places, [], shapes, [])), 1e-3)


def test_tables_of_modes(measured, tmp_path, model):
    text = mode_table_text(
        measured.points, measured.directions, measured.places, measured.frequencies, measured.shapes, np.full(N, 0.01)
    )
    found = read_mode_table(write(tmp_path / "m.csv", text), 1e-3)
    assert_allclose(found.shapes, measured.shapes, rtol=1e-7, atol=1e-12)
    assert_allclose(found.damping, 0.01)
    assert len(correlate_modes(found, model).pairs) == N
    bad = {
        "5, q, 0, 0, 0, 1": "expected x, -y",
        "5, x, 0, 0, 1": "expected 6 values, got 5",
        "5, x, 0, 0, 0, much": "expected a number, got 'much'",
        "p5, x, 0, 0, 0, 1": "number of a point",
        "5, x, 0, 0, 0, nan": "is not a number",
    }
    for row, message in bad.items():
        with pytest.raises(CorrelationError, match=message):
            read_mode_table(write(tmp_path / "m.csv", f"point, direction, x, y, z, 10 Hz\n{row}\n"), 1e-3)
    with pytest.raises(CorrelationError, match=r'such as "103\.2 Hz 1\.1 %"'):
        read_mode_table(write(tmp_path / "m.csv", "point, direction, x, y, z, first\n1, x, 0, 0, 0, 1\n"), 1e-3)


def body_maker(folder):
    """Body of the job at values of young and density."""

    def body_at(values):
        path = folder / "changed.toml"
        write(path, JOB.replace("210000", repr(float(values[0]))).replace("7.85e-9", repr(float(values[1]))))
        return job_body(read_job(path))

    return body_at


def test_update_finds_the_ratio_that_frequencies_tell(measured, folder):
    """f goes with sqrt(E / rho): the sensitivities are 1/2 and -1/2, and of both only the quotient is told.

    With priors s_E and s_rho the least squares move both by their share of the variance: the quotient of the
    specimen, and rho moves with E as -(s_rho / s_E)², to first order.
    """
    parameters = (Parameter("E", "-", YOUNG, 0.2), Parameter("rho", "-", DENSITY, 0.02))
    found = update_model(measured, body_maker(folder), parameters, frequency_spread=1e-5)
    assert found.is_converged
    assert_allclose(found.jacobian[:, 0] * YOUNG / found.values[0], 0.5 * (YOUNG / found.values[0]) ** 2, rtol=1e-5)
    ratio = found.values[0] / found.values[1]
    assert_allclose(ratio, STIFFER * YOUNG / (LIGHTER * DENSITY), rtol=1e-5)
    assert np.abs(found.after.errors).max() < 1e-5
    assert found.correlation[0, 1] > 0.99
    assert found.determined[1] < 0.1


def test_uncertainty_of_one_parameter_is_that_of_the_mean(measured, folder):
    """n frequencies, each known to sigma, of sensitivity J: 1 / spread² = n J² / sigma² + 1 / prior²."""
    sigma, prior = 0.004, 0.05

    def body_at(values):
        return body_maker(folder)(np.array([values[0], LIGHTER * DENSITY]))

    found = update_model(measured, body_at, (Parameter("E", "-", YOUNG, prior),), frequency_spread=sigma)
    J = 0.5 * YOUNG / found.values[0]
    assert_allclose(found.jacobian[:, 0], J, rtol=1e-5)
    assert_allclose(found.spread[0], (N * J**2 / sigma**2 + prior**-2.0) ** -0.5, rtol=1e-4)
    assert abs(found.values[0] / (STIFFER * YOUNG) - 1) < 3 * found.spread[0]


def test_what_the_update_refuses(measured, folder):
    with pytest.raises(CorrelationError, match="changes no frequency"):
        update_model(
            measured, lambda values: body_maker(folder)(np.array([YOUNG, DENSITY])), (Parameter("x", "x", 1.0),)
        )
    with pytest.raises(CorrelationError, match="no measured mode has a partner"):
        update_model(
            measured, body_maker(folder), (Parameter("E", "E", YOUNG), Parameter("rho", "rho", DENSITY)),
            pairing=Pairing(window=1e-6),
        )  # fmt: skip
    with pytest.raises(CorrelationError, match="start is not 0"):
        update_model(measured, body_maker(folder), (Parameter("E", "E", 0.0),))


def test_held_modes_are_those_of_a_cantilever(folder):
    model = modes_of_body(job_body(read_job(folder / "bar.toml")), 4000.0, held=["left"])
    first = 1.875104**2 / (2 * np.pi) * np.sqrt(YOUNG * 6.0**2 / 12 / (DENSITY * 100.0**4))
    assert model.frequencies[0] == pytest.approx(first, rel=0.02)
    assert not model.is_free
    with pytest.raises(CorrelationError, match=r"no interface 'lef'.*'left'"):
        modes_of_body(job_body(read_job(folder / "bar.toml")), 4000.0, held=["lef"])


def test_a_modal_file_has_the_shapes_of_its_model(folder, model):
    """Up to the first mode its static shapes carry, a Craig-Bampton body of ten modes has those of the full model."""
    path = folder / "file.toml"
    write(path, JOB.replace("n_modes = 3", "n_modes = 12"))
    reduced = modes_of_file(reduce_job(path))
    assert_allclose(reduced.frequencies[:3], model.frequencies[:3], rtol=2e-3)
    row = int(np.argmin(np.linalg.norm(reduced.nodes - [0, 0, 6], axis=1)))
    full = int(np.argmin(np.linalg.norm(model.nodes - [0, 0, 6], axis=1)))
    for k in range(3):
        sign = np.sign(reduced.shapes[row, :, k] @ model.shapes[full, :, k])
        assert_allclose(
            sign * reduced.shapes[row, :, k], model.shapes[full, :, k], atol=0.02 * np.abs(model.shapes).max()
        )


def test_damping_by_both_laws():
    f = np.array([10.0, 25.0, 80.0, 200.0])
    alpha, beta = 3.0, 2e-5
    constant, rayleigh = fit_damping(f, alpha / (4 * np.pi * f) + beta * np.pi * f)
    assert_allclose(rayleigh.values, [alpha, beta], rtol=1e-9)
    assert rayleigh.misfit < 1e-12 < constant.misfit
    assert "alpha = 3" in rayleigh.table()
    in_ms = fit_damping(f, alpha / (4 * np.pi * f) + beta * np.pi * f, time=1e-3)[1]  # a job in mm-kg-ms
    assert f"alpha = {alpha * 1e-3:.6g}\nbeta = {beta * 1e3:.6g}" in in_ms.table()
    constant, rayleigh = fit_damping(f, 1 / f)  # beta comes out negative or nothing: no job takes it
    assert (rayleigh.values >= 0).all()
    with pytest.raises(CorrelationError, match="two or more"):
        fit_damping(f[:1], [0.01])


def test_file_command_page_and_updated_job(folder, specimen, rows, tmp_path, capsys, monkeypatch):
    """From the file of a test to a job whose comments stay and whose modulus is that of the specimen."""
    for name in ("bar.inp",):
        write(tmp_path / name, (folder / name).read_text())
    write(tmp_path / "bar.toml", JOB.replace("7.85e-9", f"{LIGHTER * DENSITY!r}   # weighed"))
    shapes = specimen.shapes[rows][:, :, :N]
    zeta = np.full(N, 0.01)
    text = universal_text(rows, specimen.nodes[rows] * 1e-3, specimen.frequencies[:N], shapes, zeta)
    write(tmp_path / "modes.unv", text)
    file = write(tmp_path / "t.toml", FILE)
    updated = tmp_path / "updated.toml"
    reads, read_mesh = [], body_of_job.mesh_of_job
    monkeypatch.setattr(body_of_job, "mesh_of_job", lambda job: reads.append(job) or read_mesh(job))
    assert run(monkeypatch, ["correlate", str(file), "--updated-job", str(updated)]) == 0
    assert len(reads) == 1  # whatever the number of values
    assert "materials.steel.young" in capsys.readouterr().out
    assert "# weighed" in updated.read_text()
    job = read_job(updated)
    assert job.materials["steel"].young == pytest.approx(STIFFER * YOUNG, rel=2e-3)
    page = (tmp_path / "t.html").read_text()
    assert "MAC" in page
    assert 'id="update"' in page
    written = [tmp_path / name for name in ("out.json", "out.csv")]
    assert run(monkeypatch, ["correlate", str(file), "--json", "-o", str(written[0]), "-o", str(written[1])]) == 0
    record = json.loads(capsys.readouterr().out)
    assert [each["verdict"] for each in record["after"]["records"]] == ["pass"] * 4
    assert json.loads(written[0].read_text())["after"] == record["after"]
    np.testing.assert_array_equal(read_table(written[0])["MAC"], read_table(written[1])["MAC"])
    assert record["update"]["parameters"][0]["value"] == pytest.approx(STIFFER * YOUNG, rel=2e-3)
    assert len(record["after"]["pairs"]) == N
    for change, message in {
        ('path = "materials.steel.young"', 'path = "materials.stel.young"'): "'steel'",
        ("frequency_spread = 0.002", "frequency_spread = 0"): "above 0",
        ('file = "modes.unv"', 'file = "modes.unvv"'): "modes.unvv",
        ('job = "bar.toml"', 'body = "bar.h5"'): "give job instead of body",
    }.items():
        bad = write(tmp_path / "bad.toml", FILE.replace(*change))
        assert run(monkeypatch, ["correlate", str(bad)]) == 2
        assert message in capsys.readouterr().err
    plain = write(tmp_path / "plain.toml", FILE[: FILE.index("[update]")])
    result = cms.correlate(plain)
    assert result.update is None
    assert "Orthogonality" in html_page(correlation_document(result))
    off = result.correlation.records[1]
    assert (off.name, off.verdict) == ("test-frequency", "warn")
    assert_allclose(off.value, np.abs(result.correlation.errors).max(), rtol=1e-12)
    alone = replace(result.correlation, pairs=result.correlation.pairs[1:]).records[0]
    assert (alone.name, alone.verdict, alone.reason) == (
        "test-partners", "warn", f"{N - 1} of {N} measured modes have a partner, not 1",
    )  # fmt: skip


def run(monkeypatch, arguments):
    """Run `cms` and return its exit code."""
    monkeypatch.setattr("sys.argv", ["cms", *arguments])
    try:
        return main() or 0
    except SystemExit as end:
        return end.code or 0

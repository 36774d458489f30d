import io
import json
import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image
from scipy.linalg import eigh

import cms
from cms.assessment.compare.compare import compare_sets, draw_modes, thinned_surface
from cms.assessment.compare.comparison import Point, SetResult
from cms.assessment.compare.evaluation import drawn_entry
from cms.assessment.compare.mode_counts import mode_counts
from cms.assessment.compare.pulse import Pulse, default_pulse
from cms.assessment.compare.subsets import SUBSETS
from cms.assessment.compare.verdicts import (
    accuracy,
    answer,
    crossings,
    is_good,
    ranking,
    set_sentence,
    severity,
    shown_point,
)
from cms.assessment.quality.of_reduction.conditioning import column_condition
from cms.assessment.quality.of_reduction.frf import response_comparison
from cms.assessment.quality.record import information, judge
from cms.assessment.quality.reduction_check import check_reduction
from cms.assessment.quality.reference.full_reference import FullReference, centered_directions, moving_mass
from cms.assessment.quality.reference.port_model import FrequencyResponse, port_model
from cms.assessment.quality.reference.transient import Snapshots
from cms.cli.verdicts.compare import parse_load
from cms.errors import CompareError
from cms.modes.families.families import Families
from cms.modes.families.interface_loads import point_load
from fe_models.body.load_cases import LoadCase
from tests.bodies import bar, beam, box_mesh, chain
from tests.cms.command import run_cms
from tests.decks import JOB, write_deck

LOADED = {"benfield-hruda": {"loads": [point_load("left", mass=2.0, inertia=0.01)]}}
COUNTS = (1, 3, 6, 9)
COMPARED = ("craig-bampton", "craig-bampton-ir", "rubin", "guyan", "herting", "benfield-hruda", "craig-chang")


@pytest.fixture(scope="module")
def body():
    return cms.couple(bar(nx=8))


@pytest.fixture(scope="module")
def motion(body):
    """Two deformations that grow and fall, with some rigid-body motion in them."""
    rng = np.random.default_rng(3)
    with Families(body) as families:
        shapes = families.flexibility(rng.normal(size=(body.n_dof, 2)))
        rigid = families.Psi_R[:, :2]
    t = np.linspace(0.0, 0.01, 12)
    amplitudes = np.stack([np.sin(300 * t), t / 0.01, 3 * t, 1 - t])
    return Snapshots(np.hstack([shapes / np.abs(shapes).max(axis=0), rigid]), amplitudes, t)


@pytest.fixture(scope="module")
def comparison(body, motion):
    return compare_sets(body, {name: LOADED.get(name, {}) for name in COMPARED}, COUNTS, n_reference=6, motion=motion)


def value(result, k, name):
    return result.points[k].record(name).value


def test_sets_in_the_span_of_the_reference_are_judged_on_a_small_body():
    """24 hexahedra, 40 free modes in the band: the columns of some sets add nothing but rounding to the reference."""
    free = bar(6, 4, 1, kind="hexahedron")
    small = cms.couple(replace(free, interfaces=tuple(replace(x, kind="distributing") for x in free.interfaces)))
    found = compare_sets(small, ["guyan", "craig-bampton-ir", "rubin"], [10, 20], n_reference=40)
    assert [result.verdict for result in found.sets] == ["fail", "fail", "fail"]
    for name, make in (("craig-bampton-ir", cms.modes.craig_bampton_ir), ("rubin", cms.rubin)):
        modes = make(small, n_modes=20)
        own = np.asarray(cms.reduce(small, modes).free_frequencies)
        told = found.set(name).points[-1].record("frequency-error").data["reduced_hz"]
        assert_allclose(told[: len(own)], own, rtol=1e-7)


# Numbers of modes ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "counts"),
    [("0:3", (0, 1, 2, 3)), ("0:10:4", (0, 4, 8)), ("7", (7,)), ("5,1, 1:3", (1, 2, 3, 5)), ("4:4", (4,))],
)
def test_ranges_and_lists_name_the_numbers_of_modes(text, counts):
    assert mode_counts(text) == counts


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "not a number of modes"),
        ("a:b", "'a:b' is not"),
        ("-3", "not a number"),
        ("5:2", "down to 2"),
        ("0:5:0", "step 0"),
        ("0:9999999", "more than 500"),
        ("1:2:3:4", "not a number"),
        ("1.5", "not a number"),
    ],
)
def test_malformed_numbers_of_modes_are_refused_with_the_form_that_is_expected(text, words):
    with pytest.raises(CompareError, match=words):
        mode_counts(text)


# Subsets -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(set(SUBSETS) - {"guyan"}))
def test_the_subset_of_the_largest_set_is_the_set_with_fewer_modes(name, body):
    options = LOADED.get(name, {})
    with Families(body) as families:
        most = cms.MODE_SETS[name](families, n_modes=9, **options)
        fewer = cms.MODE_SETS[name](families, n_modes=4, **options)
        C, labels = SUBSETS[name](most, most.columns[body.b], 4)
    assert labels == fewer.labels
    scale = np.abs(fewer.columns).max(axis=0)
    assert_allclose(most.columns @ C / scale, fewer.columns / scale, rtol=0, atol=1e-10)


# Records -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", COMPARED)
def test_records_are_those_of_the_reduced_body_itself(name, body, motion, comparison):
    """The road over the reduced body and all its dofs, one set at a time, gives the same numbers."""
    k = 0 if name == "guyan" else 2
    counted = {} if name == "guyan" else {"n_modes": COUNTS[k]}
    band = comparison.full.band_hz
    with Families(body) as families, FullReference(families, band=band) as reference:
        modes = cms.MODE_SETS[name](families, **counted, **LOADED.get(name, {}))
        reduced = cms.reduce(body, modes)
        records = {r.name: r for r in check_reduction(body, modes, reduced, reference=reference, snapshots=motion)}
        grid = comparison.full.response_hz
        response = response_comparison(reference, port_model(reduced), frequencies=grid)
    point = comparison.set(name).points[k]
    assert point.n_q == reduced.n_q
    assert point.n_columns == modes.columns.shape[1]
    ours = {r.name: r for r in point.records}
    for key in ("frequency-error", "mac", "mac-nodal", "deformation-error"):
        assert_allclose(ours[key].value, records[key].value, rtol=1e-6, atol=1e-9, err_msg=key)
    for key in ("static-interface", "static-inertia"):
        assert_allclose(ours[key].value, records[key].value, rtol=1e-6, atol=1e-8, err_msg=key)
    assert_allclose(ours["residual-bound"].value, records["residual-bound"].value, rtol=1e-3, atol=1e-7)
    omega2 = float((2 * np.pi * comparison.full.frequencies_hz[0]) ** 2)
    assert_allclose(ours["conditioning"].value, column_condition(body, modes, omega2)[0], rtol=1e-6)
    assert_allclose(ours["frequency-response"].value, response.mean_error, rtol=1e-5)
    for key in records.keys() & ours.keys():
        assert ours[key].verdict == records[key].verdict, key


def test_load_cases_are_judged_as_the_check_of_the_reduced_body_judges_them():
    """A force across the middle of the bar, which the modes answer in part, and gravity, which deforms nothing."""
    free = bar(nx=6, kind="hexahedron")
    f, along = np.zeros(free.n_dof), (free.dofs[:, 1] == 2).astype(float)
    f[np.flatnonzero((np.abs(free.nodes[free.dofs[:, 0], 0] - 0.5) < 0.01) & (along > 0))] = 10.0
    cases = LoadCase("push", "force", f), LoadCase("weight", "gravity", free.M @ along)
    body = cms.couple(free.with_load_cases(*cases))
    found = compare_sets(body, ["craig-bampton", "guyan"], [3], n_reference=4)
    with Families(body) as families, FullReference(families, band=found.full.band_hz) as reference:
        for modes in (cms.craig_bampton(families, n_modes=3), cms.modes.guyan(families)):
            records = check_reduction(body, modes, cms.reduce(body, modes), reference=reference)
            expected = {record.name: record for record in records}["static-load-cases"]
            own = found.set(modes.name).points[0].record("static-load-cases")
            assert own.verdict == expected.verdict
            assert_allclose(own.data["errors"], expected.data["errors"], rtol=1e-6, atol=1e-9)
            assert np.isnan(own.data["errors"]).tolist() == [False, True]
    assert own.verdict == "warn"
    assert "static load cases" in found.set("guyan").sentence
    plain = compare_sets(cms.couple(free), ["guyan"], [0], n_reference=4)
    assert plain.set("guyan").points[0].record("static-load-cases").verdict == "info"


def test_frequencies_fall_towards_the_full_ones_as_a_set_grows(comparison):
    for name in ("craig-bampton", "craig-bampton-ir", "rubin", "herting", "benfield-hruda"):
        errors = np.array([p.record("frequency-error").data["error"] for p in comparison.set(name).points])
        errors = np.where(np.isnan(errors), np.inf, errors)
        assert (errors >= -1e-9).all()  # Ritz frequencies lie above
        assert (np.diff(errors, axis=0)[np.isfinite(errors[1:])] <= 1e-9).all()


def test_statically_complete_sets_answer_static_loads_exactly_and_others_do_not(comparison):
    for name in ("craig-bampton-ir", "rubin", "herting", "craig-chang"):
        for k in range(len(COUNTS)):
            assert value(comparison.set(name), k, "static-interface") < 1e-9
            assert value(comparison.set(name), k, "static-inertia") < 1e-9
    assert value(comparison.set("guyan"), 0, "static-interface") < 1e-9
    assert_allclose(value(comparison.set("guyan"), 0, "static-inertia"), 1.0, rtol=1e-9)


def test_effective_mass_is_that_of_the_fixed_interface_modes_of_the_set():
    body = cms.couple(beam(n=4))
    with Families(body) as families:
        directions = centered_directions(body)
        total = moving_mass(families).total
    i = body.i
    K, M = body.K.toarray()[np.ix_(i, i)], body.M.toarray()[np.ix_(i, i)]
    _, Phi = eigh(K, M)
    assert_allclose(total, ((Phi.T @ (body.M @ directions)[i]) ** 2).sum(axis=0), rtol=1e-8)
    carried = np.cumsum((Phi.T @ (body.M @ directions)[i]) ** 2, axis=0)
    counts = (2, 7, len(i) - 1)
    result = compare_sets(body, ["craig-bampton"], counts, n_reference=4).sets[0]
    for point, n_modes in zip(result.points, counts, strict=True):
        data = point.record("effective-mass").data
        assert_allclose(data["mass"].sum(axis=0), carried[n_modes - 1], rtol=1e-6, atol=1e-9 * total.max())
        assert_allclose(data["remainder"], 1 - carried[n_modes - 1] / total, rtol=0, atol=1e-6)


def test_centered_directions_turn_about_the_centre_of_mass(body):
    directions = centered_directions(body)
    mass = directions.T @ (body.M @ directions)
    assert_allclose(mass[:3, 3:], 0, rtol=0, atol=1e-12 * mass.max())
    assert_allclose(np.diag(mass)[:3], 7850 * 1.0 * 0.05 * 0.04, rtol=1e-9)


def test_redundant_columns_are_named():
    """A chain of five masses along x: whatever the columns, five are independent, and four of them elastic."""
    result = compare_sets(cms.couple(chain(n=5)), ["craig-bampton-ir"], [2], n_reference=2).sets[0]
    assert result.verdict != "error", result.sentence
    (point,) = result.points
    assert len(point.dropped) == point.record("dropped-columns").value
    assert point.n_columns - len(point.dropped) == 5
    assert point.n_q == 4


def test_the_drawn_response_is_that_with_most_resonances():
    frequencies = np.linspace(1.0, 100.0, 500)
    H = np.zeros((500, 12, 12), dtype=complex)
    for k, resonances in enumerate(([20.0], [30.0, 50.0, 70.0], [40.0, 60.0])):
        H[:, 6 + k, k] = sum(1 / (f**2 - frequencies**2 + 0.02j * f * frequencies) for f in resonances)
    labels = tuple(f"{end} {c}" for end in ("left", "right") for c in ("ux", "uy", "uz", "rx", "ry", "rz"))
    assert drawn_entry(FrequencyResponse(frequencies, H, labels, labels, "")) == (7, 1)


# Verdicts ------------------------------------------------------------------------------------------------------------


def point(n_modes, n_q, **values):
    numbers = dict.fromkeys(
        ("frequency-error", "mac", "static-interface", "static-inertia", "frequency-response", "deformation-error"), 0.0
    )
    numbers |= {key.replace("_", "-"): number for key, number in values.items()}
    records = tuple(judge(name, number, "") for name, number in numbers.items())
    return Point(n_modes, n_q + 6, n_q, (), records, is_good(records))


def result_of(name, *points):
    shown = shown_point(points)
    return SetResult(name, "", points, shown, severity(points), set_sentence(points))


def test_the_verdict_names_the_smallest_set_that_passes():
    slow = result_of("craig-bampton", point(0, 6, mac=0.5), point(10, 16, mac=0.3), point(20, 26))
    small = result_of("rubin", point(0, 12, frequency_error=0.2), point(5, 17), point(10, 22))
    never = result_of("guyan", point(0, 6, frequency_error=math.inf, mac=0.9))
    order = ranking([slow, never, small])
    assert order == ("rubin", "craig-bampton")
    words = answer([slow, never, small], order, 500.0)
    assert words.startswith("Take rubin with 5 vibration modes: 17 coordinates are good enough up to 500 Hz")
    assert "craig-bampton needs 26" in words
    assert "with 0: free frequencies 20 %, limit 1 %" in small.sentence
    assert "free frequencies with modes missing, limit 1 %" in never.sentence


def test_sets_of_equal_size_stand_in_the_order_they_were_given_in():
    a, b = (result_of(name, point(3, 15)) for name in ("rubin", "herting"))
    assert ranking([a, b]) == ("rubin", "herting")
    assert ranking([b, a]) == ("herting", "rubin")
    assert "herting needs as many" in answer([a, b], ("rubin", "herting"), 1.0)


def test_sets_of_equal_size_are_ranked_by_their_worst_number_over_its_limit():
    rough = result_of("rubin", point(3, 15, frequency_error=0.009, mac=1e-4))
    fine = result_of("herting", point(5, 15, frequency_error=1e-4, mac=0.01))
    assert [accuracy(r.detail) for r in (rough, fine)] == [0.9, 0.5]
    assert ranking([rough, fine]) == ("herting", "rubin")


def test_a_set_that_misses_a_limit_and_fails_none_warns_as_a_check_does():
    near = result_of("craig-bampton", point(9, 15, static_inertia=0.2))
    assert (near.verdict, near.detail.record("static-inertia").verdict) == ("warn", "warn")
    assert near.sentence.startswith("misses a limit, though not by far, with 9 vibration modes: static inertia loads")
    assert (
        "matters if the body accelerates as a whole; a set with inertia relief, such as craig-bampton-ir"
        in near.sentence
    )
    assert "inertia relief" not in result_of("guyan", point(0, 6, mac=0.9)).sentence
    far = result_of("guyan", point(0, 6, mac=0.9, static_inertia=0.2))
    assert far.verdict == "fail"
    assert ranking([near, far]) == ()
    assert "Nearest comes craig-bampton" in answer([far, near], (), 100.0)


def test_where_no_set_passes_the_answer_names_the_nearest_and_what_it_misses():
    far = result_of("guyan", point(0, 6, mac=0.9, frequency_error=0.5, static_inertia=1.0))
    near = result_of("craig-bampton", point(9, 15, static_inertia=0.2))
    words = answer([far, near], (), 100.0)
    assert "Nearest comes craig-bampton with 9 vibration modes, which misses: static inertia loads" in words


def test_a_record_that_does_not_apply_decides_nothing():
    records = (judge("frequency-error", 0.0, ""), information("static-inertia", "no such load"))
    assert is_good(records)
    assert not is_good((*records, judge("mac", math.nan, "")))


def test_crossings_tell_from_where_on_a_limit_is_kept_for_good():
    a = result_of("rubin", point(0, 6, mac=0.0), point(2, 8, mac=0.5), point(4, 10, mac=0.001))
    b = result_of("guyan", point(0, 6, mac=0.5))
    assert crossings([a, b], "mac") == "Within the limit of 2 %: rubin from 4 modes on; not guyan."


def test_the_shown_point_is_the_first_good_one(body):
    comparison = compare_sets(body, COMPARED[:4], (0, 4, 8, 12), n_reference=3)
    assert comparison.ranking
    for result in comparison.sets:
        good = [p.n_modes for p in result.points if p.is_good]
        assert result.detail.n_modes == (good[0] if good else result.points[-1].n_modes)
    best = comparison.set(comparison.ranking[0]).detail
    assert best.n_q == min(p.n_q for result in comparison.sets for p in result.points if p.is_good)


# Failures of a set, the file of the full model -----------------------------------------------------------------------


def test_a_set_that_cannot_be_made_says_why_and_stops_no_other(body):
    result = compare_sets(body, ["benfield-hruda", "normal", "rubin"], [0, 4, 5000], n_reference=3)
    assert result.set("benfield-hruda").verdict == "error"
    assert "expected loads" in result.set("benfield-hruda").sentence
    assert [p.n_modes for p in result.set("normal").points] == [4]
    assert "not possible with 0, 5000: " in result.set("normal").sentence
    assert [p.n_modes for p in result.set("rubin").points] == [0, 4]
    assert result.set("rubin").points
    assert result.set("benfield-hruda").detail is None


def test_the_full_model_is_solved_once_and_read_after_that(body, tmp_path, caplog):
    path = tmp_path / "full.npz"
    first = compare_sets(body, ["rubin"], [3], n_reference=3, cache=path)
    again = compare_sets(body, ["rubin"], [3], n_reference=3, cache=path)
    assert (first.full.was_cached, again.full.was_cached) == (False, True)
    for a, b in zip(first.sets[0].points[0].records, again.sets[0].points[0].records, strict=True):
        assert_allclose(b.value, a.value, rtol=1e-9, atol=1e-12)
    other = compare_sets(body, ["rubin"], [3], n_reference=4, cache=path)
    assert not other.full.was_cached
    path.write_bytes(path.read_bytes()[:1000])
    torn = compare_sets(body, ["rubin"], [3], n_reference=4, cache=path)
    assert not torn.full.was_cached
    assert "computed anew" in caplog.text


def test_another_body_does_not_take_the_solution_of_the_first(body, tmp_path):
    path = tmp_path / "full.npz"
    compare_sets(body, ["rubin"], [2], n_reference=3, cache=path)
    heavier = replace(body, M=body.M * 2.0)
    result = compare_sets(heavier, ["rubin"], [2], n_reference=3, cache=path)
    assert not result.full.was_cached


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"sets": ["rubn"]}, "did you mean 'rubin'"),
        ({"sets": []}, "at least one mode set"),
        ({"counts": []}, "numbers of modes"),
        ({"band": -1.0}, "above 0 Hz"),
        ({"band": 1e-3}, "the first elastic mode of body 'bar' is at"),
        ({"n_reference": 0}, "1 or more"),
        ({"damping": 0.0}, "between 0 and 1"),
    ],
)
def test_what_cannot_be_compared_is_refused(body, asked, words):
    given = {"sets": ["rubin"], "counts": [2], **asked}
    with pytest.raises(CompareError, match=words):
        compare_sets(body, given.pop("sets"), given.pop("counts"), **given)


def test_a_body_without_interfaces_is_refused(body):
    with pytest.raises(CompareError, match="no interface"):
        default_pulse(replace(body, interfaces=()))


# Pulse and drawing ---------------------------------------------------------------------------------------------------


def test_the_pulse_is_a_unit_force_whose_spectrum_ends_near_the_band(body):
    band = 800.0
    load = Pulse("left").load(body, band=band, first=100.0)
    force = np.linalg.norm(load.p[:3], axis=0)
    assert_allclose(force.max(), 1.0, rtol=1e-3)
    assert_array_equal(load.p[3:], 0)
    spectrum = np.abs(np.fft.rfft(force, 2**16))
    f = np.fft.rfftfreq(2**16, load.t[1])
    assert spectrum[f > 1.05 * band].max() < 0.03 * spectrum[0] < spectrum[np.searchsorted(f, 0.5 * band)]


def test_a_body_without_a_surface_is_drawn_by_the_lines_of_its_stiffness():
    drawing = draw_modes(beam(n=4), np.eye(30)[:, :2])
    assert_array_equal(drawing.lines, [[0, 1], [1, 2], [2, 3], [3, 4]])
    assert drawing.triangles.shape == (0, 3)


def test_the_drawn_shapes_are_those_of_the_body_at_the_drawn_nodes(body):
    Phi = np.random.default_rng(0).normal(size=(body.n_dof, 3))
    drawing = draw_modes(body, Phi)
    used = np.unique(body.surface)
    expected = np.moveaxis(body.translations(Phi)[used], 2, 0)
    expected /= np.linalg.norm(expected, axis=2).max(axis=1)[:, None, None]
    assert_allclose(drawing.shapes, expected, rtol=1e-12)
    assert_array_equal(drawing.nodes, body.nodes[used])


# Command -------------------------------------------------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path):
    write_deck(tmp_path / "bar.inp", box_mesh(6, 2, 2, 100.0, 10.0, 10.0, "hexahedron"))
    (tmp_path / "bar.toml").write_text(JOB)
    return tmp_path


def run(*arguments):
    return run_cms("compare", *arguments)


def test_the_command_writes_table_page_and_numbers_that_agree(folder, monkeypatch):
    """Charts of the PDF are white here: tests/fe_models/foundation/documents draws them."""
    Image.new("RGB", (8, 8), "white").save(white := io.BytesIO(), "png")
    monkeypatch.setattr("fe_models.foundation.documents.pdf.chart_png", lambda chart, width: white.getvalue())
    result = run(
        folder / "bar.toml", "--sets", "guyan,rubin,benfield-hruda", "--modes", "0:12:4", "-o", folder / "out",
        "--load", "right:mass=1e-5", "--stills", "0", "--reference-modes", "5",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    written = json.loads((folder / "out" / "comparison.json").read_text())
    assert written["answer"] in result.stdout
    for found in written["sets"]:
        assert found["verdict"] != "error", found["sentence"]
        assert f"{found['name']}: {found['sentence']}" in result.stdout
    assert [p["n_modes"] for p in written["sets"][1]["points"]] == [0, 4, 8, 12]
    assert (folder / "out" / "comparison.html").is_file()
    assert (folder / "out" / "full_model.npz").is_file()
    again = run(folder / "bar.toml", "--sets", "rubin", "--modes", "4", "-o", folder / "out", "--stills", "0",
                "--reference-modes", "5")  # fmt: skip
    assert "full model taken from an earlier comparison" in again.stdout


@pytest.mark.long
def test_a_cluster_judges_as_processes_do_and_both_as_this_process(folder):
    """Bit for bit, but for the seconds; against the factorisation that all sets share, to rounding."""
    pytest.importorskip("distributed")
    found = {}
    for name, workers in (("alone", []), ("two", ["-j", "2"]), ("dask", ["--workers", "dask:2"])):
        result = run(
            folder / "bar.toml", "--sets", "guyan,rubin,craig-chang", "--modes", "2,5", "-o", folder / name, "--stills",
            "0", "--reference-modes", "5", *workers,
        )  # fmt: skip
        assert result.exit_code == 0, result.output
        found[name] = json.loads((folder / name / "comparison.json").read_text())
        for each in found[name]["sets"]:
            del each["seconds"]
    assert found["two"]["sets"] == found["dask"]["sets"]
    for one, other in zip(found["alone"]["sets"], found["two"]["sets"], strict=True):
        assert (one["name"], one["verdict"]) == (other["name"], other["verdict"])
        assert [p["n_modes"] for p in one["points"]] == [p["n_modes"] for p in other["points"]]
        for p, q in zip(one["points"], other["points"], strict=True):
            assert_allclose(errors_of(q), errors_of(p), rtol=1e-6, atol=1e-10)


def errors_of(point):
    return [record["value"] for record in point["records"] if record["name"] in ("frequency-error", "static-interface")]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--workers", "dsak"], ["expected a number of processes, dask"]),
        (["--sets", "craig-bamton"], ["unknown mode set 'craig-bamton'", "did you mean 'craig-bampton'"]),
        (["--sets", "rubin,rubin"], ["twice"]),
        (["--sets", ","], ["expected names"]),
        (["--modes", "0-30"], ["0:30 (from:to)"]),
        (["--modes", "9:1"], ["expected 1:9"]),
        (["--band", "-5"], ["above 0 Hz"]),
        (["--load", "right:mas=3"], ["unknown key 'mas'", "did you mean 'mass'"]),
        (["--load", "right"], ["INTERFACE:mass="]),
        (["--load", "right:mass=heavy"], ["expected a number"]),
        (["--motion", "bar.inp"], ["expected an .npz file"]),
        (["--pulse-at", "rihgt"], ["did you mean 'right'"]),
    ],
)
def test_bad_input_is_one_message_with_the_nearest_name(folder, arguments, words, monkeypatch):
    monkeypatch.chdir(folder)
    result = run("bar.toml", *arguments)
    assert result.exit_code == 2, result.output
    assert result.stderr.count("error: ") == 1
    assert "Traceback" not in result.output
    for word in words:
        assert word in result.stderr


def test_files_without_a_full_model_are_refused_with_what_is_needed(folder):
    (folder / "bar.h5").write_bytes(b"")
    (folder / "bar.npz").write_bytes(b"")
    foreign, matrices = run(folder / "bar.h5"), run(folder / "bar.npz")
    assert foreign.exit_code == matrices.exit_code == 2
    assert "holds no full model" in foreign.stderr
    assert "cms check" in foreign.stderr
    assert "expected a job file" in matrices.stderr


def test_the_output_is_never_a_file(folder):
    (folder / "out").write_text("")
    result = run(folder / "bar.toml", "-o", folder / "out")
    assert result.exit_code == 2
    assert "expected a folder" in result.stderr


def test_a_motion_of_another_body_is_refused(folder):
    np.savez(folder / "motion.npz", u=np.zeros((5, 3)), t=np.zeros(3))
    result = run(folder / "bar.toml", "--motion", folder / "motion.npz")
    assert result.exit_code == 2
    assert "u has shape (5, 3)" in result.stderr


def test_a_load_of_the_command_line_is_the_point_load():
    load, expected = parse_load("pin:mass=2,stiffness=1e4"), point_load("pin", mass=2.0, stiffness=1e4)
    assert load.interfaces == ("pin",)
    assert_array_equal(load.M, expected.M)
    assert_array_equal(load.K, expected.K)


def test_thinning_keeps_nodes_and_bounds_the_number_of_triangles():
    s = np.linspace(0, 1, 60)
    x, y = np.meshgrid(s, s, indexing="ij")
    nodes = np.stack([x.ravel(), y.ravel(), 0.1 * np.sin(6 * x.ravel())], axis=1)
    k = np.arange(59 * 60).reshape(59, 60)[:, :-1].ravel()
    triangles = np.concatenate([np.stack([k, k + 60, k + 1], 1), np.stack([k + 1, k + 60, k + 61], 1)])
    thin = thinned_surface(nodes, triangles, 1500)
    assert 100 < len(thin) <= 1600
    assert thin.min() >= 0
    assert thin.max() < len(nodes)
    area = 0.5 * np.linalg.norm(
        np.cross(nodes[thin[:, 1]] - nodes[thin[:, 0]], nodes[thin[:, 2]] - nodes[thin[:, 0]]), axis=1
    )
    full = 0.5 * np.linalg.norm(
        np.cross(
            nodes[triangles[:, 1]] - nodes[triangles[:, 0]], nodes[triangles[:, 2]] - nodes[triangles[:, 0]]
        ), axis=1,
    )  # fmt: skip
    assert_allclose(area.sum(), full.sum(), rtol=0.02)

"""The laboratory: substitution keeps the system, errors are distances from the reference, and what fails is told apart.

A blade of 1 m on a pin that turns it by a smooth step, 8 rad in a second (lowest frequency held 8 Hz).
"""

import csv
import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import floatframe as ff
from cms.body.modal_file.file import write as write_body
from cms.modes.families.families import Families
from cms.pipeline import reduce_job
from floatframe.cli import main
from floatframe.design.laboratory.figures import convergence_figure
from floatframe.design.laboratory.full_model import all_dofs
from floatframe.design.laboratory.laboratory import BodyShelf, distance
from floatframe.design.laboratory.laboratory_file import read_laboratory, run_laboratory
from floatframe.design.laboratory.substitution import with_body
from floatframe.errors import ModelError
from floatframe.files.system_file.read_system import read_system
from floatframe.results.sensors import measured
from tests.bodies import bar, box_mesh
from tests.decks import write_deck

JOB = """
[body]
name = "blade"
mesh = "blade.inp"
units = "mm-t-s"

[materials.alloy]
young = 70000
poisson = 0.3
density = 2.7e-9

[interfaces.root]
kind = "rigid"
nodes = "left"

[interfaces.tip]
kind = "rigid"
nodes = "right"

[reduction]
n_modes = 4
frame = "nodal"
at = "root"
"""
SYSTEM = """
[system]
units = "mm-t-s"
gravity = [0, 0, 0]

[bodies.blade]
file = "blade.h5"

[joints.root]
type = "revolute"
body_a = "ground"
marker_a = [0, 5, 2]
body_b = "blade"
marker_b = "root"
axis = [0, 0, 1]

[joints.root.motions.angle]
type = "smooth-step"
t_start = 0.0
t_end = 1.0
first = 0.0
last = 8.0

[sensors.tip]
type = "position"
body = "blade"
marker = "tip"

[sensors.load]
type = "reaction"
of = "root"

[run]
t_end = 1.0
h = 5e-3
"""
LABORATORY = """
system = "spin.toml"
body = "blade"
job = "blade.toml"
sensors = ["tip"]

[vary]
n_modes = "1:2"
frames = ["nodal:root", "tisserand"]
stiffening = [true, false]
parts = [1, 2]

[reference]
n_modes = 4
parts = 3
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("laboratory")
    write_deck(folder / "blade.inp", box_mesh(12, 1, 1, 1000.0, 10.0, 4.0, kind="hexahedron20"))
    for name, text in {"blade.toml": JOB, "spin.toml": SYSTEM, "laboratory.toml": LABORATORY}.items():
        (folder / name).write_text(text)
    write_body(reduce_job(folder / "blade.toml"), folder / "blade.h5")
    return folder


@pytest.fixture(scope="module")
def result(folder):
    return run_laboratory(read_laboratory(folder / "laboratory.toml"))


def test_every_combination_is_a_case_and_parts_have_mean_axes():
    cases = ff.design.laboratory.grid(
        n_modes=(1, 2), frames=("nodal:root", "tisserand"), stiffening=(True, False), parts=(1, 2)
    )
    assert len(cases) == 2 * 2 * 2 + 2 * 2  # the frame does not matter to parts
    assert {case.frame for case in cases if case.parts == 2} == {"tisserand"}
    with pytest.raises(ModelError, match="\"nodal:INTERFACE\", got 'nodal'"):
        ff.design.laboratory.Case(frame="nodal")


def test_a_body_in_the_place_of_itself_changes_nothing(folder):
    system, run = read_system(folder / "spin.toml")
    again = with_body(system, "blade", [system.body("blade").reduced], stiffening=True)
    columns = [
        measured(each, ff.integrate(each, run.integrator, 0.2, run.h))["tip"].columns for each in (system, again)
    ]
    assert_allclose(columns[0]["x"], columns[1]["x"], rtol=0, atol=1e-12)
    assert_allclose(columns[0]["y"], columns[1]["y"], rtol=0, atol=1e-12)


def test_stiffening_and_parts_come_near_the_reference_and_a_linear_frame_does_not(result):
    """At this speed the range of a linear frame ends (a note says so), and truncation is no matter."""
    by_case = {row.case: row for row in result.cases}
    assert not [row.failure for row in result.cases if row.failure]
    linear = by_case[ff.design.laboratory.Case("craig-bampton", 2, "nodal:root", False, 1)]
    stiff = by_case[ff.design.laboratory.Case("craig-bampton", 2, "nodal:root", True, 1)]
    parts = by_case[ff.design.laboratory.Case("craig-bampton", 2, "tisserand", True, 2)]
    assert linear.error > 3 * stiff.error
    assert parts.error < linear.error / 3
    assert any("left the range of its linear frame" in note for note in linear.notes)
    assert linear.fails_first == "description"
    assert parts.n_q > stiff.n_q
    assert all(row.seconds > 0 for row in result.cases)


def test_rows_are_tidy_and_truncation_is_the_distance_from_the_richest(result):
    rows = result.table()
    assert len(rows) == len(result.cases)
    assert len({tuple(row) for row in rows}) == 1
    for row in result.cases:
        same = [other for other in result.cases if other.case.family == row.case.family]
        if row.case.n_modes == max(other.case.n_modes for other in same):
            assert row.truncation == 0.0
            assert row.description == pytest.approx(row.error)
        else:
            assert row.truncation > 0


def test_a_reference_from_elsewhere(folder, tmp_path):
    """Columns of a rigid blade in closed form: the error is that of bending, the same as by hand."""
    system, run = read_system(folder / "spin.toml")
    t = np.linspace(0.0, 1.0, 2001)
    s = t**3 * (10 - 15 * t + 6 * t**2)
    x, y = 1000 * np.cos(8 * s), 5 + 1000 * np.sin(8 * s)
    reference = ff.design.laboratory.Reference("a rigid blade", t, {"tip x": x, "tip y": y})
    case = ff.design.laboratory.Case("craig-bampton", 2, "nodal:root", True, 1)
    found = ff.design.laboratory.study(
        system, "blade", folder / "blade.toml", [case], integrator=run.integrator, t_end=1.0, h=run.h,
        reference=reference, sensors=["tip"],
    )  # fmt: skip
    (row,) = found.cases
    motion = ff.integrate(system, run.integrator, 1.0, run.h)
    tip = measured(system, motion)["tip"].columns
    expected = np.sqrt(np.mean((tip["x"] - np.interp(motion.t, t, x)) ** 2)) / np.ptp(x)
    assert row.errors["tip x"] == pytest.approx(expected, rel=0.02)  # two modes for four
    assert set(row.errors) == {"tip x", "tip y"}
    np.savetxt(
        tmp_path / "rigid.csv", np.column_stack([t, x, y]), delimiter=",", header="time [s],tip x,tip y", comments=""
    )
    text = (
        LABORATORY[: LABORATORY.index("[vary]")]
        + '[vary]\nframes = ["nodal:root"]\nn_modes = [2]\n[reference]\nfile = "rigid.csv"\n'
    )
    for name in ("spin.toml", "blade.toml"):
        text = text.replace(f'"{name}"', f'"{folder / name}"')
    (tmp_path / "file.toml").write_text(text)
    same = run_laboratory(read_laboratory(tmp_path / "file.toml"))
    assert same.cases[0].error == pytest.approx(row.error, rel=1e-3)


@pytest.mark.parametrize(("watch", "is_told"), [("stop", True), ("off", False)])
def test_runs_are_watched_as_the_system_file_says(folder, tmp_path, watch, is_told):
    """Two steps of a twentieth of the motion distort it by more than the limit of a note."""
    (tmp_path / "spin.toml").write_text(
        SYSTEM.replace("t_end = 1.0\nh = 5e-3", f't_end = 0.1\nh = 0.05\nwatch = "{watch}"')
    )
    shutil.copy(folder / "blade.h5", tmp_path)
    text = LABORATORY[: LABORATORY.index("[vary]")].replace("blade.toml", str(folder / "blade.toml"))
    (tmp_path / "file.toml").write_text(f"{text}[vary]\nn_modes = [1]\n[reference]\nfile = 'tip.csv'\n")
    (tmp_path / "tip.csv").write_text("time [s],tip x\n0,1000\n1,-150\n")
    row = run_laboratory(read_laboratory(tmp_path / "file.toml")).cases[0]
    assert not row.failure
    assert any("take a step of about" in note for note in row.notes) == is_told, row.notes


def test_a_case_that_fails_is_a_row(folder):
    system, run = read_system(folder / "spin.toml")
    good, bad = (
        ff.design.laboratory.Case(n_modes=1, frame="nodal:root"),
        ff.design.laboratory.Case(n_modes=1, frame="nodal:nowhere"),
    )
    found = ff.design.laboratory.study(
        system,
        "blade",
        folder / "blade.toml",
        [good, bad],
        integrator=run.integrator,
        t_end=0.05,
        h=run.h,
        reference=good,
    )
    assert "nowhere" in found.cases[1].failure
    assert found.cases[0].error == 0.0
    assert np.isnan(found.cases[1].error)


def test_what_is_refused(folder):
    system, run = read_system(folder / "spin.toml")

    def study(**changes):
        given = {
            "system": system,
            "body": "blade",
            "job": folder / "blade.toml",
            "cases": [ff.design.laboratory.Case(n_modes=1)],
        }
        given |= {
            "integrator": run.integrator,
            "t_end": 0.02,
            "h": run.h,
            "reference": ff.design.laboratory.Case(n_modes=1),
        } | changes
        return ff.design.laboratory.study(**given)

    with pytest.raises(ModelError, match=r"no body 'blad'.*'blade'"):
        study(body="blad")
    with pytest.raises(ModelError, match="expected some of tip, load; got hub"):
        study(sensors=["hub"])
    with pytest.raises(ModelError, match="expected a moving column"):
        study(reference=ff.design.laboratory.Reference("other", np.array([0.0, 1.0]), {"hub x": np.array([0.0, 1.0])}))
    with pytest.raises(ModelError, match="at least one case"):
        study(cases=[])


def test_distances():
    t = np.linspace(0, 1, 101)
    assert distance(t, t + 0.5, 2.0) == pytest.approx(0.25)
    assert distance(t, np.full(101, np.nan), 1.0) == np.inf


def test_command_and_picture(folder, result, tmp_path, capsys, monkeypatch):
    figure = convergence_figure(result)
    assert len(figure.axes[0].lines) == len({row.case.family for row in result.cases})
    file = tmp_path / "small.toml"
    text = LABORATORY.replace('n_modes = "1:2"', "n_modes = [1]").replace("parts = [1, 2]", "").replace("parts = 3", "")
    for name in ("spin.toml", "blade.toml"):
        text = text.replace(f'"{name}"', f'"{folder / name}"')
    file.write_text(text)
    outputs = [tmp_path / name for name in ("a.csv", "a.json", "a.svg", "a.html")]
    monkeypatch.setattr("sys.argv", ["floatframe", "compare", str(file), *(w for o in outputs for w in ("-o", str(o)))])
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code, capsys.readouterr().err
    assert "against craig-bampton" in capsys.readouterr().out
    rows = list(csv.DictReader(outputs[0].read_text().splitlines()))
    record = json.loads(outputs[1].read_text())
    assert len(rows) == len(record["cases"]) == 4
    assert float(rows[0]["error"]) == pytest.approx(record["cases"][0]["error"])
    assert outputs[2].read_text().startswith("<?xml")
    page = outputs[3].read_text()
    assert all(f"{100 * float(row['error']):.3g}" in page for row in rows)


def test_the_full_model_is_where_cases_lead(folder, tmp_path):
    """Unreduced inside the system: distances from it fall with the modes, down to modes of it that no step resolves."""
    system, run = read_system(folder / "spin.toml")
    found = ff.design.laboratory.study(
        system, "blade", folder / "blade.toml",
        ff.design.laboratory.grid(mode_sets=("craig-bampton-ir",), n_modes=(0, 2, 6)),
        integrator=run.integrator, t_end=0.2, h=run.h, reference=ff.design.laboratory.FullModel(), sensors=["tip"],
    )  # fmt: skip
    errors = [row.error for row in found.cases]
    assert errors[0] > 10 * errors[1]
    assert errors[0] > 10 * errors[2] > 0
    assert "full finite element model" in found.reference
    with pytest.raises(ModelError, match=r"full model of body 'blade' has \d+ dofs, more than 20"):
        ff.design.laboratory.study(
            system, "blade", folder / "blade.toml", [ff.design.laboratory.Case(n_modes=1)],
            integrator=run.integrator, t_end=0.1, h=run.h,
            reference=ff.design.laboratory.FullModel(most_dofs=20),
        )  # fmt: skip
    text = LABORATORY[: LABORATORY.index("[reference]")]
    for name in ("spin.toml", "blade.toml"):
        text = text.replace(f'"{name}"', f'"{folder / name}"')
    (tmp_path / "full.toml").write_text(text + '[reference]\nkind = "full-model"\nmost_dofs = 500\n')
    assert read_laboratory(tmp_path / "full.toml").reference.asked == ff.design.laboratory.FullModel(500)
    (tmp_path / "both.toml").write_text(text + '[reference]\nkind = "full-model"\nn_modes = 5\n')
    with pytest.raises(ModelError, match='kind = "full-model": expected no n_modes'):
        read_laboratory(tmp_path / "both.toml")


def test_all_dofs_of_distributing_interfaces_follow_their_members():
    """The frequencies of the body with all dofs are those of the model, multipliers and all."""
    bodies = bar(nx=2)
    ends = tuple(replace(i, kind="distributing") for i in bodies.interfaces)
    body = cms.couple(replace(bodies, interfaces=ends))
    reduced = cms.reduce(body, all_dofs(body))
    with Families(body) as families:
        expected = families.free_modes(12).frequencies
    assert_allclose(reduced.free_frequencies[:12], expected, rtol=1e-7)
    assert reduced.n_q == 3 * len(bar(nx=2).nodes) - 6


def test_cases_share_one_factorisation_and_one_search_for_modes(folder, monkeypatch):
    """Two sets, two frames, three numbers of modes; the bodies are those that a job reduces alone."""
    from cms.modes.families import families as module

    counts = {"fix_interfaces": 0, "fixed_interface_modes": 0}
    for name in counts:

        def counted(*given, of=getattr(module, name), name=name, **names):
            counts[name] += 1
            return of(*given, **names)

        monkeypatch.setattr(module, name, counted)
    cases = ff.design.laboratory.grid(
        mode_sets=("craig-bampton", "craig-bampton-ir"), n_modes=(1, 2, 4), frames=("nodal:root", "tisserand")
    )
    with BodyShelf(folder / "blade.toml", cases=cases) as shelf:
        bodies = {case: shelf.reduced(case)[0] for case in cases}
        assert counts == {"fix_interfaces": 1, "fixed_interface_modes": 1}
    alone = reduce_job(folder / "blade.toml")
    shared = bodies[ff.design.laboratory.Case("craig-bampton", 4, "nodal:root")]
    assert_allclose(np.diag(shared.K), np.diag(alone.K), rtol=1e-9)
    assert_allclose(shared.geometric.spin, alone.geometric.spin, rtol=0, atol=1e-6 * np.abs(alone.geometric.spin).max())


LINES_JOB = """
[body]
name = "blade"
nodes = "nodes.csv"
lines = "lines.csv"
units = "mm-t-s"

[materials.alloy]
young = 70000
poisson = 0.3
density = 2.7e-9

[sections.flat]
lines = "all"
shape = "rectangle"
width = 10
height = 4

[interfaces.root]
kind = "rigid"
nodes = "root"

[interfaces.tip]
kind = "rigid"
nodes = "tip"

[reduction]
n_modes = 4
frame = "nodal"
at = "root"
"""


def test_exact_beams_are_a_reference_for_bodies_of_lines(tmp_path):
    """The stiffened blade is near them and the linear one is not; they say how far they are settled themselves."""
    (tmp_path / "nodes.csv").write_text(
        "node,x,y,z,sets\n" + "".join(
            f"{k},{125.0 * k},5,2,{'root' if k == 0 else 'tip' if k == 8 else ''}\n" for k in range(9)
        )
    )  # fmt: skip
    (tmp_path / "lines.csv").write_text("node1,node2\n" + "".join(f"{k},{k + 1}\n" for k in range(8)))
    (tmp_path / "blade.toml").write_text(LINES_JOB)
    bend = '[sensors.bend]\ntype = "displacement"\nbody = "blade"\nmarker = "tip"\n\n'
    system_text = SYSTEM.replace("[sensors.load]", bend + "[sensors.load]")
    (tmp_path / "spin.toml").write_text(system_text)
    write_body(reduce_job(tmp_path / "blade.toml"), tmp_path / "blade.h5")
    (tmp_path / "laboratory.toml").write_text(
        LABORATORY[: LABORATORY.index("[vary]")].replace('["tip"]', '["tip", "load", "bend"]')
        + '[vary]\nframes = ["nodal:root"]\nstiffening = [true, false]\nparts = [1, 4]\nn_modes = [4]\n'
        + '[reference]\nkind = "exact-beam"\nelements = 16\n'
    )
    found = run_laboratory(read_laboratory(tmp_path / "laboratory.toml"))
    by_words = {row.case.description: row.errors["tip y"] for row in found.cases}
    assert 0 < found.settled < 2e-3
    assert by_words["craig-bampton, nodal:root"] < by_words["craig-bampton, nodal:root, linear"] / 3
    assert by_words["craig-bampton, tisserand, 4 parts"] < 3 * found.settled + 1e-4
    assert "geometrically exact beams" in found.reference
    assert "without bend" in found.reference
    assert not [name for name in found.columns if name.startswith("bend")]
    assert len(convergence_figure(found).axes[0].lines) == len({row.case.family for row in found.cases}) + 1


def test_exact_beams_of_a_solid_are_refused(folder):
    system, run = read_system(folder / "spin.toml")
    with pytest.raises(ModelError, match="does not consist of beams alone"):
        ff.design.laboratory.study(
            system, "blade", folder / "blade.toml", [ff.design.laboratory.Case(n_modes=1)],
            integrator=run.integrator, t_end=0.1, h=run.h,
            reference=ff.design.laboratory.ExactBeam(),
        )  # fmt: skip

import contextlib
import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.testing import assert_allclose
from typer.testing import CliRunner

import cms
from cms.assessment.quality.body_record import body_record, central_inertia
from cms.body.modal_file.contents import Content
from cms.body.modal_file.file import VERSION, read, write, write_sealed
from cms.cli import demo
from cms.cli.outputs import DOCUMENTS, TABLES, output_files, write_outputs
from cms.errors import JobError
from cms.jobs.job import read_job
from cms.pipeline import reduce_job
from cms.reduction.basis.frames import TisserandFrame
from cms.reduction.frame_conversion import convert_frame
from fe_models.foundation.documents.document import Answer, Document
from fe_models.foundation.extras import MissingExtraError
from floatframe.cli.app import app as floatframe_app
from tests.bodies import box_mesh
from tests.cms.command import assert_refused, run_cms
from tests.decks import JOB, write_deck
from tests.root import ROOT, heed_signals
from tests.synthetic import synthetic_reduced_body

PROGRAM = [sys.executable, "-c", "from cms.cli import main; main()"]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}


def bar():
    return box_mesh(6, 2, 2, 100.0, 10.0, 10.0, "hexahedron")


@pytest.fixture
def folder(tmp_path) -> Path:
    """A folder with a good job and its mesh."""
    write_deck(tmp_path / "bar.inp", bar())
    (tmp_path / "bar.toml").write_text(JOB)
    return tmp_path


@pytest.fixture(scope="module")
def modal_file(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("modal") / "bar.h5"
    write(synthetic_reduced_body(), path)
    return path


def contents(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in sorted(folder.iterdir())}


# Good input ----------------------------------------------------------------------------------------------------------


def test_reduce_writes_the_body_that_the_job_describes(folder):
    result = run_cms("reduce", folder / "bar.toml", "-o", folder / "out.h5", code=0)
    body = read(folder / "out.h5")
    assert_allclose(body.moments.m, 7.85e-9 * 100 * 10 * 10, rtol=1e-12)
    assert_allclose(body.frame.origin, [0, 5, 5], rtol=0, atol=1e-9)
    assert (body.frame.kind, body.frame.at) == ("nodal", "left")
    assert [(i.name, i.kind) for i in body.interfaces] == [("left", "rigid"), ("right", "distributing")]
    assert_allclose(body.D, np.diag(2 * 0.01 * np.sqrt(np.diag(body.K))), rtol=1e-12, atol=0)
    assert body.units.name == "mm-t-s"
    for word in ("Mesh", "Modes", "Interfaces", "Time", "assemble", "24 hexahedron", "wrote"):
        assert word in result.stdout
    assert sorted(contents(folder)) == ["bar.inp", "bar.toml", "out.h5"]


def test_the_default_output_stands_beside_the_job(folder):
    run_cms("reduce", folder / "bar.toml", code=0)
    assert (folder / "bar.h5").is_file()


def test_file_line_and_memory_line_agree_bit_for_bit(folder):
    body = reduce_job(read_job(folder / "bar.toml"))
    write(body, folder / "a.h5")
    again = read(folder / "a.h5")
    assert again.Phi.tobytes() == body.Phi.tobytes()
    assert again.moments.S_kl.tobytes() == body.moments.S_kl.tobytes()


def test_reduce_takes_the_fewest_modes_for_an_error(folder):
    """And states the errors of what it made; the table of the job has a number of modes, which gives way."""
    result = run_cms(
        "reduce", folder / "bar.toml", "-o", folder / "few.h5", "--error", "1e-2", "--up-to", "20kHz", code=0
    )
    told = " ".join(result.stdout.split())
    assert (
        "modes are the fewest for an estimated error of the free frequencies of at most 0.01 from 0 to 20000 Hz" in told
    )
    assert "estimated errors by the reduction" in told
    made = read(folder / "few.h5")
    assert 0 < made.errors.frequency[made.free_frequencies[: len(made.errors.frequency)] < 20e3].max() <= 0.005
    record = json.loads(run_cms("info", folder / "few.h5", "--json").stdout)["errors"]
    assert_allclose(record["frequency"], made.errors.frequency)
    assert record["method"] == made.errors.method


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--error", "1e-3"], "--error needs --up-to"),
        (["--up-to", "2kHz"], "--up-to needs --error"),
        (["--error", "1e-3", "--up-to", "30rpm"], "--up-to 30rpm: expected a frequency such as 500Hz or 2kHz"),
        (["--error", "2", "--up-to", "2kHz"], "error = 2.0: expected a number between 0 and 1"),
    ],
)
def test_an_error_that_cannot_be_met_is_refused(folder, words, message):
    assert_refused(run_cms("reduce", folder / "bar.toml", "-o", folder / "x.h5", *words), message)
    assert not (folder / "x.h5").exists()


def test_reduce_warns_of_a_body_too_large_once_and_info_again(folder, caplog):
    """The bar is 100 mm long; its numbers read as metres make a body of 101 m of steel."""
    text = JOB.replace("mm-t-s", "m-kg-s").replace("210000", "2.1e11").replace("7.85e-9", "7850.0")
    (folder / "bar.toml").write_text(text)
    result = run_cms("reduce", folder / "bar.toml", code=0)
    assert caplog.text.count("the body is 101 m large") == 1  # a note on standard error
    assert "101 m large" not in result.stdout
    assert run_cms("info", folder / "bar.h5").stdout.count("the body is 101 m large") == 1


def test_cutoff_is_in_hertz_in_every_unit_system(folder):
    """The bar in mm-kg-ms has frequencies in kHz; the cut-off keeps the same modes."""
    job = JOB.replace("n_modes = 3", "cutoff = 150000.0")
    (folder / "bar.toml").write_text(job)
    body = reduce_job(read_job(folder / "bar.toml"))
    ms = job.replace("mm-t-s", "mm-kg-ms").replace("210000", "210").replace("7.85e-9", "7.85e-6")
    (folder / "bar.toml").write_text(ms)
    body_ms = reduce_job(read_job(folder / "bar.toml"))
    assert body.n_q > 6
    hertz = [[mode["frequency_hz"] for mode in body_record(b)["modes"]] for b in (body, body_ms)]
    assert_allclose(hertz[0], hertz[1], rtol=1e-6)


def test_two_materials_by_group_of_cells(folder):
    light = '[materials.light]\nyoung = 70000\npoisson = 0.3\ndensity = 2.7e-9\ncells = ["right half"]\n'
    job = JOB.replace("density = 7.85e-9", 'density = 7.85e-9\ncells = "left half"').replace(
        "[interfaces.left]", light + "[interfaces.left]"
    )
    (folder / "bar.toml").write_text(job)
    body = reduce_job(read_job(folder / "bar.toml"))
    assert_allclose(body.moments.m, (7.85e-9 + 2.7e-9) * 5000, rtol=1e-12)


def test_a_triad_lists_the_axes_of_the_interface(folder):
    rows = "triad = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]"
    (folder / "bar.toml").write_text(JOB.replace('nodes = "left"', f'nodes = "left"\n{rows}'))
    body = reduce_job(read_job(folder / "bar.toml"))
    assert_allclose(body.interface("left").triad[:, 0], [0, 1, 0], rtol=0, atol=1e-15)


def test_matrices_reduce_without_a_mesh(folder):
    from tests.bodies import bar as bar_body

    body = bar_body(nx=4)
    M, K = body.M.tocoo(), body.K.tocoo()
    np.savez(
        folder / "bar.npz",
        M_row=M.row,
        M_col=M.col,
        M_data=M.data,
        K_row=K.row,
        K_col=K.col,
        K_data=K.data,
        nodes=body.nodes,
        dofs=body.dofs,
        **{f"interface/{i.name}/nodes": i.nodes for i in body.interfaces},
    )
    (folder / "bar.toml").write_text('[body]\nmatrices = "bar.npz"\nunits = "m-kg-s"\n[reduction]\nn_modes = 2\n')
    result = run_cms("reduce", folder / "bar.toml", code=0)
    assert_allclose(read(folder / "bar.h5").moments.m, 7850 * 0.05 * 0.04, rtol=1e-12)
    assert read(folder / "bar.h5").geometric is None
    (folder / "bar.toml").write_text((folder / "bar.toml").read_text() + "geometric_stiffness = true\n")
    result = run_cms("reduce", folder / "bar.toml", "-o", folder / "other.h5")
    assert_refused(result, "geometric stiffness needs the elements", "geometric_stiffness = false")


@pytest.mark.parametrize("wanted", ["", "geometric_stiffness = true", "geometric_stiffness = false"])
def test_a_job_of_a_mesh_has_geometric_stiffness_unless_it_is_left_out(folder, wanted):
    (folder / "bar.toml").write_text(JOB.replace("[reduction]", f"[reduction]\n{wanted}"))
    assert (reduce_job(read_job(folder / "bar.toml")).geometric is None) == wanted.endswith("false")


def test_a_job_leaves_the_loads_out_that_lead_to_a_buckens_frame(folder):
    geometric = []
    for wanted in ("", "spread_loads = false"):
        (folder / "bar.toml").write_text(JOB.replace("[reduction]", f"[reduction]\n{wanted}"))
        geometric.append(reduce_job(read_job(folder / "bar.toml")).geometric)
    with_them, without = geometric
    assert with_them.spread is not None
    assert without.spread is None
    assert_allclose(without.interfaces, with_them.interfaces, rtol=0, atol=1e-9 * np.abs(with_them.interfaces).max())
    both = "[reduction]\nspread_loads = true\ngeometric_stiffness = false"
    (folder / "bar.toml").write_text(JOB.replace("[reduction]", both))
    assert_refused(run_cms("reduce", folder / "bar.toml"), "spread_loads = true belongs to the geometric stiffness")


LOADS = """
[load_cases.push]
kind = "pressure"
plane = {point = [100, 0, 0], normal = [1, 0, 0]}
pressure = 2.0
[load_cases.weight]
kind = "gravity"
acceleration = [0, 0, -9810]
[load_cases.twist]
kind = "force"
at = "right"
force = [0, 3, 0]
torque = [40, 0, 0]
[load_cases.side]
kind = "force"
box = {lo = [0, -1, -1], hi = [100, 0, 11]}
force = [0, 0, 5]
reference = [50, 0, 5]
[reduction]
stress = false
axes = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
"""


def test_reduce_keeps_the_load_cases_of_the_job_with_their_resultants(folder):
    """Bar 100 x 10 x 10 mm, B at the middle of the left end with turned axes: x of B is y of the mesh."""
    (folder / "bar.toml").write_text(JOB.replace("[reduction]\n", LOADS).replace("ratio = 0.01", "ramp = true"))
    result = run_cms("reduce", folder / "bar.toml", "-o", folder / "out.h5", code=0)
    body = read(folder / "out.h5")
    assert body.stress is None
    to_B = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    weight = 7.85e-9 * 1e4 * 9810
    for name, force, torque in [
        ("push", [-200, 0, 0], [0, 0, 0]),
        ("weight", [0, 0, -weight], [0, 50 * weight, 0]),
        ("twist", [0, 3, 0], [40, 0, 300]),
        ("side", [0, 0, 5], [-25, -250, 0]),
    ]:
        case = body.load_case(name)
        assert_allclose(case.force, to_B @ force, rtol=0, atol=1e-9 * 200)
        assert_allclose(case.torque, to_B @ torque, rtol=0, atol=1e-9 * 2e4)
    Psi = body.interface("right").Psi
    assert_allclose(body.load_case("twist").h, Psi.T @ np.r_[to_B @ [0, 3, 0], to_B @ [40, 0, 0]], rtol=0,
                    atol=1e-9 * np.abs(Psi).max() * 40)  # fmt: skip
    assert "Load cases" in result.stdout


def test_info_prints_what_is_in_the_file(modal_file):
    result = run_cms("info", modal_file, code=0)
    for word in ("synthetic", "mm-t-s", "nodal at big_end", "kleines Auge/2 µ", "fixed-interface", "rod.msh", "digest",
                 "Zünden/1", "pressure", "torque about the origin", "at the kept nodes and at 2 points"):  # fmt: skip
        assert word in result.stdout


def test_info_in_other_units(modal_file):
    result = run_cms("info", modal_file, "--units", "m-kg-s", code=0)
    body = synthetic_reduced_body()
    for word in ("m-kg-s", f"{body.moments.m * 1000:.6g} kg", "units converted from"):
        assert word in result.stdout
    record = json.loads(run_cms("info", modal_file, "--units", "m-kg-s", "--json").stdout)
    assert_allclose(record["load_cases"][0]["force"], body.load_cases[0].force, rtol=1e-14)  # mm t/s² are newtons too
    assert_allclose(record["load_cases"][0]["torque"], body.load_cases[0].torque / 1000, rtol=1e-14)
    assert_refused(run_cms("info", modal_file, "--units", "m-kg"), "did you mean 'm-kg-s'?")


def test_frame_writes_the_body_in_the_other_frame(modal_file, tmp_path):
    path = tmp_path / "rod.h5"
    path.write_bytes(modal_file.read_bytes())
    result = run_cms("frame", path, "--to", "tisserand", code=0)
    assert "tisserand" in result.stdout
    expected = convert_frame(read(path), TisserandFrame())
    written = read(tmp_path / "rod_tisserand.h5")
    assert_allclose(written.Phi, expected.Phi, rtol=0, atol=0)
    options = ["--origin", "1,2,3", "--axes", "0,1,0;-1,0,0;0,0,1", "--damping", "0.03", "--units", "m-kg-s"]
    result = run_cms("frame", path, "--to", "buckens", *options, "-o", tmp_path / "b.h5", code=0)
    assert "x axis of B" in result.stdout
    body = read(tmp_path / "b.h5")
    assert body.frame.kind == "buckens"
    assert_allclose(body.frame.origin, [1, 2, 3], rtol=0, atol=0)
    assert_allclose(body.frame.axes, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], rtol=0, atol=0)
    assert_allclose(np.diag(body.D), 2 * 0.03 * np.sqrt(np.diag(body.K)), rtol=1e-12)
    assert body.units.name == "m-kg-s"


def test_frame_refuses_what_it_cannot_do(modal_file, tmp_path):
    path = tmp_path / "rod.h5"
    path.write_bytes(modal_file.read_bytes())
    before = contents(tmp_path)
    for options, words in [
        (("--to", "tiserand"), "unknown frame; did you mean 'tisserand'?"),
        (("--to", "tisserand", "--at", "big_end"), "belongs to --to nodal"),
        (("--to", "nodal", "--at", "big_ent"), "did you mean 'big_end'?"),
        (("--to", "buckens", "--origin", "1,2"), "expected three numbers with commas"),
        (("--to", "buckens", "--axes", "1,0,0;0,1,0"), "expected three axes"),
        (("--to", "buckens", "--axes", "1,0,0;0,1,0;0,0,-1"), "three orthonormal right-handed axes"),
        (("--to", "buckens", "--damping", "-1"), "ratio = -1.0; expected 0 to 1"),
        (("--to", "buckens", "--damping", "0.3"), "--heavy of a command"),
        (("--to", "buckens", "--units", "m-kg"), "did you mean 'm-kg-s'?"),
        (("--to", "buckens", "-o", path), "this is an input; choose another name"),
    ]:
        assert_refused(run_cms("frame", path, *options), words)
        assert contents(tmp_path) == before


def test_frame_takes_a_damping_ratio_above_a_fifth_if_it_is_confirmed(modal_file, tmp_path):
    run_cms("frame", modal_file, "--to", "buckens", "--damping", "0.3", "--heavy", "-o", tmp_path / "b.h5", code=0)
    body = read(tmp_path / "b.h5")
    assert_allclose(np.diag(body.D), 2 * 0.3 * np.sqrt(np.diag(body.K)), rtol=1e-12)


def test_info_json_is_the_record(modal_file):
    result = run_cms("info", modal_file, "--json", code=0)
    record = json.loads(result.stdout)
    body = synthetic_reduced_body()
    assert record["mass"] == body.moments.m
    assert record["modes"][0]["frequency_hz"] == body.frequencies[0]
    assert_allclose(record["modes"][1]["damping_ratio"], 0.01, rtol=1e-12)
    assert len(record["digest"]) == 64


def test_view_draws_a_picture_beside_the_modal_file(modal_file, tmp_path):
    path = tmp_path / "bar.h5"
    path.write_bytes(modal_file.read_bytes())
    result = run_cms("view", path, "--mode", "2", code=0)
    assert sorted(contents(tmp_path)) == ["bar.h5", "bar_mode2.png"]
    assert (tmp_path / "bar_mode2.png").read_bytes().startswith(b"\x89PNG")
    assert "wrote" in result.stdout


def test_view_draws_films_and_pictures_where_it_is_told(modal_file, tmp_path, monkeypatch):
    """Which functions are called with what; the drawing has its own tests."""
    calls = []

    def recorded(kind):
        return lambda body, mode, path, **options: (calls.append((kind, mode, options["scale"])), path.touch())

    monkeypatch.setattr("cms.assessment.report.view.view_mode", recorded("picture"))
    monkeypatch.setattr("cms.assessment.report.view.animate_mode", recorded("film"))
    run_cms("view", modal_file, "-m", "3", "-a", tmp_path / "m.gif", "--scale", "0.2", code=0)
    assert calls == [("film", 3, 0.2)]
    run_cms("view", modal_file, "-a", tmp_path / "m.gif", "-o", tmp_path / "m.png", code=0)
    assert calls[1:] == [("picture", 1, None), ("film", 1, None)]
    assert sorted(contents(tmp_path)) == ["m.gif", "m.png"]


def test_central_inertia_is_that_of_the_point_masses():
    rng = np.random.default_rng(0)
    mass, c = rng.uniform(1, 2, 7), rng.normal(size=(7, 3))
    body = synthetic_reduced_body(n_q=1)
    moments = type(body.moments)(
        mass.sum(), mass @ c, (c.T * mass) @ c, body.moments.C1, body.moments.P, body.moments.S_kl
    )
    d = c - mass @ c / mass.sum()
    expected = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(mass, d, strict=True))
    assert_allclose(central_inertia(moments), expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_the_record_gives_the_centre_of_mass_in_mesh_coordinates(folder):
    body = cms.reduce_job(folder / "bar.toml")
    assert_allclose(body_record(body)["center_of_mass"]["mesh"], [50, 5, 5], rtol=1e-12)
    assert_allclose(body_record(body)["center_of_mass"]["B"], [50, 0, 0], rtol=0, atol=1e-9)


def test_the_demo_runs_the_whole_line_and_lists_its_files(tmp_path, monkeypatch):
    """All commands in this process, with blank pictures: drawing and the start of processes have their own tests."""

    def blank(*arguments, **_):
        next(a for a in arguments if isinstance(a, Path)).write_bytes(b"")

    class Signal(io.BytesIO):
        def write(self, line):
            self.run()

    def begun_here(running, folder, commands):
        said = io.BytesIO()

        def run():
            for command in commands:
                demo.announce(folder, f"floatframe {command}")
                with contextlib.chdir(folder):
                    done = CliRunner().invoke(floatframe_app, command.split())
                assert done.exit_code == 0, done.output
                said.write(done.output.encode())
            said.seek(0)

        signal = Signal()
        signal.run = run
        return SimpleNamespace(returncode=0, wait=lambda: 0, stdin=signal, stdout=said)

    for name in (
        "cms.assessment.report.view.view_mode", "cms.assessment.report.view.animate_mode",
        "floatframe.pictures.animation.animate",
    ):  # fmt: skip
        monkeypatch.setattr(name, blank)
    monkeypatch.setattr("floatframe.pictures.overview.overview_pages", lambda *_: Figure())
    monkeypatch.setattr(demo, "begun", begun_here)
    assert_demo_makes_its_files(tmp_path, monkeypatch)


@pytest.mark.long
def test_the_demo_as_a_user_starts_it_draws_all_its_pictures(tmp_path, monkeypatch):
    files = assert_demo_makes_its_files(tmp_path, monkeypatch)
    for name, magic in (("m3.png", b"\x89PNG"), ("m3.gif", b"GIF8"), ("crank.png", b"\x89PNG")):
        assert files[name].startswith(magic)
    assert b"ftyp" in files["crank.mp4"][:16]


def assert_demo_makes_its_files(tmp_path, monkeypatch):
    """Run the demo and return its files by name; raise `AssertionError` if a command or a file is missing."""
    monkeypatch.chdir(tmp_path)
    result = run_cms("demo", code=0)
    files = contents(tmp_path / "demo")
    for name in (
        "rod.h5", "job.schema.json", "m3.png", "m3.gif", "crank.h5", "crank.png", "crank.mp4", "system.schema.json",
    ):  # fmt: skip
        assert name in files
        assert name in result.stdout
    for command in ("cms reduce", "cms info", "cms view", "floatframe run", "floatframe plot", "floatframe animate"):
        assert f"demo$ {command}" in result.stdout
    assert json.loads(files["rod.json"])["name"] == "rod"
    return files


def test_the_demo_needs_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "demo").write_text("a file")
    assert_refused(run_cms("demo"), "demo: cannot be made")
    assert contents(tmp_path) == {"demo": b"a file"}


# Bad input -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("old", "new", "words"), [
    ('mesh = "bar.inp"', 'mesh = "baz.inp"', ["body.mesh", "no such file", "did you mean 'bar.inp'?"]),
    ('units = "mm-t-s"', 'unit = "mm-t-s"', ["body.unit: unknown key; did you mean 'units'?"]),
    ('units = "mm-t-s"', 'units = "m-kg-s"', ["unit", "7.85e-09"]),
    ("n_modes = 3", 'n_modes = 3\nset = "craig-bamton"', ["did you mean 'craig-bampton'?"]),
    ("young = 210000", "young = 0", ["materials.steel.young = 0: expected a number above 0"]),
    ("density = 7.85e-9", "density = -1", ["materials.steel.density = -1"]),
    ("poisson = 0.3", "poisson = 0.5", ["materials.steel.poisson = 0.5"]),
    ("young = 210000", "young = nan", ["materials.steel.young = nan"]),
    ('nodes = "left"', 'nodes = "lefd"', ["interface 'left'", "'lefd'", "did you mean 'left'?"]),
    ('nodes = "left"', 'faces = "left"', ["no face group 'left'", "is a node set"]),
    ("density = 7.85e-9", 'density = 7.85e-9\ncells = "al"', ["group of cells 'al'", "did you mean 'all'?"]),
    ("density = 7.85e-9", 'density = 7.85e-9\ncells = "left half"', ["cells without a material", "right half"]),
    ("point = [100, 0, 0]", "point = [101, 0, 0]", ["interface 'right'", "no surface node"]),
    ("plane = {point = [100, 0, 0], normal = [1, 0, 0]}", 'nodes = "top"', ["'left' and 'right' share"]),
    ('nodes = "left"', "box = {lo = [0, 0, 0], hi = [100, 0, 0]}", ["interface 'left'", "on one line"]),
    ('nodes = "left"', "nearest = {point = [0, 0, 0]}", ["interface 'left'", "at least 3 nodes"]),
    ("n_modes = 3", "n_modes = 3000", ["n_modes = 3000", "interior dofs"]),
])  # fmt: skip
def test_a_bad_job_ends_in_one_message_and_leaves_nothing(folder, old, new, words):
    assert JOB.count(old) == 1
    (folder / "bar.toml").write_text(JOB.replace(old, new))
    before = contents(folder)
    assert_refused(run_cms("reduce", folder / "bar.toml"), *words)
    assert contents(folder) == before


def bad_meshes():
    mesh = bar()
    cells = mesh.cells["hexahedron"]
    inverted = cells.copy()
    inverted[3] = inverted[3][[4, 5, 6, 7, 0, 1, 2, 3]]
    apart = np.concatenate([mesh.nodes, mesh.nodes + np.array([0, 50, 0])])
    nan = mesh.nodes.copy()
    nan[5, 1] = np.nan
    replaced = {"nodes": mesh.nodes, "cells": {"hexahedron": cells}, "node_sets": mesh.node_sets}
    return {
        "inverted": ({**replaced, "cells": {"hexahedron": inverted}}, ["inverted"]),
        "unconnected": (
            {**replaced, "nodes": apart, "cells": {"hexahedron": np.concatenate([cells, cells + len(mesh.nodes)])}},
            ["2 ", "parts"],
        ),
        "nan": ({**replaced, "nodes": nan}, ["nan"]),
    }


@pytest.mark.parametrize("kind", ["inverted", "unconnected", "nan"])
def test_a_bad_mesh_ends_in_one_message_and_leaves_nothing(folder, kind):
    from fe_models.meshes.mesh import Mesh

    arrays, words = bad_meshes()[kind]
    write_deck(folder / "bar.inp", Mesh(**arrays))
    before = contents(folder)
    result = run_cms("reduce", folder / "bar.toml")
    assert_refused(result)
    assert all(word in result.stderr.lower() for word in words), result.stderr
    assert contents(folder) == before


def test_matrices_with_nan_are_refused(folder):
    from tests.bodies import bar as bar_body

    body = bar_body(nx=2)
    K = body.K.toarray()
    K[3, 3] = np.nan
    np.savez(folder / "bar.npz", M=body.M.toarray(), K=K, nodes=body.nodes, dofs=body.dofs)
    (folder / "bar.toml").write_text('[body]\nmatrices = "bar.npz"\nunits = "m-kg-s"\n[reduction]\nn_modes = 2\n')
    before = contents(folder)
    assert_refused(run_cms("reduce", folder / "bar.toml"), "K: expected finite numbers")
    assert contents(folder) == before


@pytest.mark.parametrize("content", [b"", b"\x89HDF\r\n\x1a\n" + bytes(range(256)) * 8, b"*NODE\n1, 0, 0\n",
                                     b"PK\x03\x04" + b"\0" * 100])  # fmt: skip
@pytest.mark.parametrize("suffix", [".inp", ".msh", ".vtu", ".bdf", ".xyz"])
def test_a_mesh_that_is_no_mesh_is_refused(folder, content, suffix):
    (folder / f"garbage{suffix}").write_bytes(content)
    (folder / "bar.toml").write_text(JOB.replace("bar.inp", f"garbage{suffix}"))
    before = contents(folder)
    assert_refused(run_cms("reduce", folder / "bar.toml"), f"garbage{suffix}")
    assert contents(folder) == before


def test_a_mechanism_is_named(folder):
    """Two blocks that share one edge: a hinge, which no solid mesh report may miss and no reduction may swallow."""
    from fe_models.meshes.mesh import Mesh

    one = box_mesh(1, 1, 1, 10.0, 10.0, 10.0, "hexahedron")
    other = one.nodes + np.array([10, 10, 0])
    nodes = np.unique(np.concatenate([one.nodes, other]), axis=0)
    cells = one.cells["hexahedron"]
    number = {tuple(x): k for k, x in enumerate(nodes.tolist())}
    place = [[number[tuple(x)] for x in block[cells[0]].tolist()] for block in (one.nodes, other)]
    mesh = Mesh(nodes, {"hexahedron": np.array(place)}, node_sets={"left": np.flatnonzero(nodes[:, 0] == 0)})
    write_deck(folder / "bar.inp", mesh)
    job = re.sub(r"\[interfaces.right\].*?\n\n", "", JOB, flags=re.DOTALL).replace("n_modes = 3", 'set = "guyan"')
    (folder / "bar.toml").write_text(job)
    before = contents(folder)
    assert_refused(run_cms("reduce", folder / "bar.toml"), "1 motions without energy", "at (20, 20, 0)")
    assert contents(folder) == before


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda b: b[: len(b) // 2], "truncated"),
        (lambda b: b[:100], "truncated"),
        (lambda b: b[:5000] + bytes([b[5000] ^ 1]) + b[5001:], "altered"),
        (lambda b: b"", "not a modal-file"),
        (lambda b: b"some text", "not a modal-file"),
    ],
)
@pytest.mark.parametrize("command", [["info"], ["info", "--json"], ["view"]])
def test_a_damaged_modal_file_is_refused(modal_file, tmp_path, damage, words, command):
    path = tmp_path / "bad.h5"
    path.write_bytes(damage(modal_file.read_bytes()))
    result = run_cms(command[0], path, *command[1:])
    assert_refused(result, words)
    assert result.stdout == ""


def test_other_and_newer_and_missing_files_are_refused(tmp_path, modal_file):
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = 1.0
    assert_refused(run_cms("info", tmp_path / "other.h5"), "HDF5 of another program")
    write_sealed(Content("modal-file", VERSION + 1, {}), tmp_path / "new.h5")
    assert_refused(run_cms("info", tmp_path / "new.h5"), f"format version {VERSION + 1}", "update")
    assert_refused(run_cms("info", modal_file.with_name("baz.h5")), "did you mean 'bar.h5'?")


@pytest.mark.parametrize(("options", "words"), [
    (["--mode", "6"], "expected a mode between 1 and 5"),
    (["--mode", "0"], "expected a mode between 1 and 5"),
    (["--mode", "1", "-o", "m.jpg"], "ends in .png"),
    (["--mode", "1", "--animate", "m.png"], ".gif or .mp4"),
    (["--mode", "1", "--scale", "-1"], "scale"),
    (["--mode", "1", "-o", "bar.h5"], "this is an input; choose another name"),
    (["--mode", "1", "-o", "nowhere/m.png"], "does not exist"),
])  # fmt: skip
def test_view_refuses_what_it_cannot_draw(modal_file, tmp_path, monkeypatch, options, words):
    (tmp_path / "bar.h5").write_bytes(modal_file.read_bytes())
    monkeypatch.chdir(tmp_path)
    assert_refused(run_cms("view", "bar.h5", *options), words)
    assert sorted(contents(tmp_path)) == ["bar.h5"]


def test_the_output_is_checked_before_the_work(folder):
    before = contents(folder)
    for output, words in [
        ("nowhere/out.h5", "does not exist"),
        ("bar.toml", "this is an input; choose another name"),
        ("bar.inp", "this is an input; choose another name"),
        (".", "this is a folder"),
    ]:
        assert_refused(run_cms("reduce", folder / "bar.toml", "-o", folder / output), words)
    assert contents(folder) == before


def test_a_fault_of_the_program_has_exit_code_1_and_a_traceback_only_with_debug(folder, monkeypatch):
    def fail(*_, **__):
        raise ZeroDivisionError("unlucky")

    monkeypatch.setattr("cms.pipeline.reduce_job", fail)
    result = run_cms("reduce", folder / "bar.toml", code=1)
    assert "ZeroDivisionError: unlucky" in result.stderr
    assert "Traceback" not in result.output
    assert "Traceback" in run_cms("--debug", "reduce", folder / "bar.toml").stderr
    assert sorted(contents(folder)) == ["bar.inp", "bar.toml"]


def test_an_interrupt_has_exit_code_130(folder, monkeypatch):
    def fail(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("cms.pipeline.reduce_job", fail)
    result = run_cms("reduce", folder / "bar.toml", code=130)
    assert result.stderr.startswith("error: interrupted")


# The program itself --------------------------------------------------------------------------------------------------


def test_a_full_disk_leaves_the_old_file_and_one_message(folder):
    (folder / "out.h5").write_bytes(b"the old file")
    before = contents(folder)
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096)); "
    program = [sys.executable, "-c", limit + PROGRAM[2]]
    result = subprocess.run(
        [*program, "reduce", "bar.toml", "-o", "out.h5"], cwd=folder, env=ENVIRONMENT, capture_output=True, text=True
    )
    assert result.returncode == 2, result.stderr
    assert result.stderr.startswith("error: ")
    assert "cannot be written" in result.stderr
    assert "Traceback" not in result.stderr
    assert contents(folder) == before


def test_a_killed_run_leaves_the_old_file(folder):
    """Ctrl-C while the job runs, from outside."""
    (folder / "out.h5").write_bytes(b"the old file")
    before = contents(folder)
    slow = "import cms.body.modal_file.file as m, time\n"
    slow += "m.write = lambda *_: (print('ready', flush=True), time.sleep(60))\n"
    program = [sys.executable, "-c", slow + PROGRAM[2]]
    with subprocess.Popen(
        [*program, "reduce", "bar.toml", "-o", "out.h5"],
        cwd=folder,
        env=ENVIRONMENT,
        preexec_fn=heed_signals,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        assert process.stdout.readline() == "ready\n"
        time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        _, error = process.communicate()
    assert process.returncode == 130
    assert error.startswith("error: interrupted")
    assert "Traceback" not in error
    assert contents(folder) == before


def test_a_paragraph_of_help_fills_its_lines():
    """Line breaks of a docstring are not those of the terminal."""
    told = run_cms("reduce", "--help", env={"COLUMNS": "200"}).stdout
    assert "With several jobs or --workers, each job is a task; finished jobs are recorded" in told


def test_help_names_the_commands_and_loads_nothing_heavy():
    script = PROGRAM[2].replace("main()", "\ntry: main()\nfinally: import sys; print(sorted(sys.modules))")
    result = subprocess.run([sys.executable, "-c", script, "--help"], env=ENVIRONMENT, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    for command in ("reduce", "info", "frame", "view", "demo"):
        assert command in result.stdout
    loaded = result.stdout[result.stdout.rindex("[") :]
    for heavy in ("numpy", "scipy", "h5py", "pydantic", "meshio", "skfem", "pyvista", "numba", "matplotlib"):
        assert f"'{heavy}'" not in loaded


def test_output_survives_a_terminal_without_unicode(modal_file):
    environment = {**ENVIRONMENT, "PYTHONIOENCODING": "ascii", "TERM": "dumb", "NO_COLOR": "1"}
    result = subprocess.run([*PROGRAM, "info", str(modal_file)], env=environment, capture_output=True)
    assert result.returncode == 0, result.stderr
    assert b"\x1b" not in result.stdout
    assert result.stdout.isascii()


def test_version_and_unknown_commands():
    assert run_cms("--version").stdout.startswith("cms ")
    result = run_cms("reduse", code=2)
    assert "reduse" in result.stderr
    assert run_cms().exit_code in (0, 2)


@pytest.mark.parametrize(("ending", "library"), [(".parquet", "pyarrow"), (".pdf", "reportlab")])
def test_a_missing_library_of_an_output_is_told_before_the_work(ending, library, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(MissingExtraError, match=r"pip install"):
        output_files([tmp_path / f"result{ending}"], [], (*DOCUMENTS, *TABLES), JobError)


def test_a_page_and_a_pdf_are_of_one_document(tmp_path):
    made = []

    def document():
        made.append(Document("bar", "one bar", Answer("It holds."), ()))
        return made[-1]

    paths = [tmp_path / "bar.html", tmp_path / "bar.pdf"]
    write_outputs(paths, document=document)
    assert len(made) == 1
    assert [path.read_bytes()[:4] for path in paths] == [b"<!do", b"%PDF"]

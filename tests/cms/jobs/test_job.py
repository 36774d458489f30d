from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from cms.errors import JobError
from cms.jobs.job import read_job
from cms.jobs.mode_set_of_job import frame_of, load_of
from cms.reduction.basis.damping import ModalDamping, PerModeDamping, RampDamping, RayleighDamping
from cms.reduction.basis.frames import BuckensFrame, NodalFrame
from tests.root import ROOT

DOCUMENT = ROOT / "docs" / "job_file.md"

GOOD = """
[body]
mesh = "rod.msh"
units = "mm-t-s"
[materials.steel]
young = 210000
poisson = 0.3
density = 7.85e-9
[interfaces.big_end]
kind = "rigid"
plane = {point = [0, 0, 0], normal = [0, 0, 1]}
[interfaces.small_end]
kind = "nodes"
nodes = "left"
triad = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
[load_cases.weight]
kind = "gravity"
acceleration = [0, 0, -9810]
[load_cases.firing]
kind = "pressure"
pressure = 12
plane = {point = [0, 0, 0], normal = [0, 0, 1]}
[load_cases.pull]
kind = "force"
torque = [0, 0, 3]
at = "small_end"
[reduction]
n_modes = 12
frame = "nodal"
at = "big_end"
[damping]
ratio = 0.01
"""


LOADED = 'set = "benfield-hruda"\nloads = {'
SIX_ROWS = np.eye(6).tolist()


@pytest.fixture
def job_file(tmp_path):
    (tmp_path / "rod.msh").touch()

    def write(text: str) -> Path:
        (tmp_path / "rod.toml").write_text(text, encoding="utf-8")
        return tmp_path / "rod.toml"

    return write


def test_a_good_job_is_read(job_file):
    path = job_file(GOOD)
    job = read_job(path)
    assert job.body.name == "rod"
    assert job.body.mesh == path.parent / "rod.msh"
    assert job.materials["steel"].young == 210000.0
    assert job.materials["steel"].cells == ("all",)
    assert [(i.plane is None, i.nodes is None) for i in job.interfaces.values()] == [(False, True), (True, False)]
    assert job.interfaces["small_end"].triad == ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    assert (job.reduction.set, job.reduction.n_modes, job.reduction.cutoff) == ("craig-bampton", 12, None)
    assert (job.damping.ratio, job.damping.alpha) == (0.01, None)


@pytest.mark.parametrize(("old", "new", "words"), [
    ("units = ", "unit = ", 'body.unit: unknown key; did you mean \'units\'?'),
    ('"mm-t-s"', '"mm-t"', "body.units = \"mm-t\": unknown unit system; did you mean 'mm-t-s'? choices: cm-g-s"),
    ('"rod.msh"', '"rot.msh"', "rot.msh; did you mean 'rod.msh'?"),
    ('"rod.msh"', '"no/rod.msh"', "does not exist"),
    ('mesh = "rod.msh"', "", "body: expected either mesh or matrices, got neither"),
    ("young = 210000", "young = 0", "materials.steel.young = 0: expected a number above 0"),
    ("young = 210000", 'young = "2e5"', "expected a number above 0"),
    ("young = 210000", "young = inf", "expected a number above 0"),
    ("young = 210000", "young = true", "materials.steel.young = true: expected a number above 0"),
    ("density = 7.85e-9", "density = -7.85e-9", "materials.steel.density = -7.85e-09: expected a number, 0 or more"),
    ("density = 7.85e-9", "", "materials.steel.density: missing; expected a number, 0 or more"),
    ("poisson = 0.3", "poisson = 0.5", "materials.steel.poisson = 0.5: expected a number between -1 and 0.5"),
    ("poisson = 0.3", "poisson = nan", "expected a number between -1 and 0.5"),
    ('kind = "rigid"', 'kind = "rigit"', "interfaces.big_end.kind = \"rigit\": unknown kind; did you mean 'rigid'?"),
    ('nodes = "left"', "", "interfaces.small_end: expected exactly one of faces, nodes, plane"),
    ('nodes = "left"', 'nodes = "left"\nfaces = "left"', "got faces, nodes"),
    ("normal = [0, 0, 1]", "normal = [0, 0]", "interfaces.big_end.plane.normal = [0, 0]: expected three numbers"),
    ("normal = [0, 0, 1]", "norml = [0, 0, 1]", "interfaces.big_end.plane.norml: unknown key; did you mean 'normal'?"),
    ("[[0, 1, 0], [-1, 0, 0], [0, 0, 1]]", "[[0, 1, 0], [-1, 0], [0, 0, 1]]", "expected three rows of three numbers"),
    ("n_modes = 12", "n_modes = 12.5", "reduction.n_modes = 12.5: expected a whole number"),
    ("n_modes = 12", "n_modes = -1", "reduction.n_modes = -1: expected a whole number, 0 or more"),
    ("n_modes = 12", "n_modes = 12\ncutoff = 100.0", "reduction: expected either n_modes"),
    ("n_modes = 12", "", "or cutoff (up to which frequency in Hz), got neither"),
    ("n_modes = 12", 'n_modes = 12\nset = "craig-bamton"', "did you mean 'craig-bampton'? choices: assumed-modes"),
    ("n_modes = 12", 'n_modes = 12\nset = "guyan"', "mode set 'guyan' has no option n_modes"),
    ('at = "big_end"', 'at = "big_ent"', "\"big_ent\": there is no such interface; did you mean 'big_end'?"),
    ('frame = "nodal"', 'frame = "tisserand"', 'belongs to frame = "nodal"'),
    ('frame = "nodal"', 'frame = "modal"', "unknown frame; did you mean 'nodal'?"),
    ("ratio = 0.01", "ratio = 0.01\nalpha = 1.0", "expected either ratio, ratios, ramp, alpha and beta, or file; got"),
    ("[damping]", "[dampning]", "dampning: unknown key; did you mean 'damping'?"),
    ("[reduction]", "[reductio]", "reductio: unknown key; did you mean 'reduction'?"),
    ("[damping]", "[interfaces.x]\nkind='rigid'\nbox=3\n[damping]", "interfaces.x.box = 3: expected a table {lo, hi}"),
    ("[damping]", "[materials.b]\nyoung=1\npoisson=0\ndensity=1\n[damping]", "there are 2 materials; name the group"),
    ('kind = "gravity"', 'kind = "gravitas"', "weight.kind = \"gravitas\": unknown kind; did you mean 'grav"),
    ("acceleration = ", "pressure = 1\nforce =", "weight: a load case of kind 'gravity' has no key pressure"),
    ("acceleration = [0, 0, -9810]", "", "load_cases.weight: acceleration: missing; how large is the load?"),
    ("acceleration = [0, 0, -9810]", "box = {lo=[0,0,0], hi=[1,1,1]}", "kind 'gravity' has no key box"),
    ("pressure = 12", "", "load_cases.firing: pressure: missing; how large is the load?"),
    ("pressure = 12", "pressure = 12\nbox={lo=[0,0,0],hi=[1,1,1]}", "expected exactly one of faces, nodes, plane"),
    ("pressure = 12", "pressure = nan", "load_cases.firing.pressure = nan: expected a number"),
    ("torque = [0, 0, 3]", "", "load_cases.pull: force or torque: missing"),
    ('at = "small_end"\n', "", "expected exactly one of at, faces, nodes"),
    ('at = "small_end"', 'at = "smal_end"', "pull.at = \"smal_end\": there is no such interface; did you mean"),
    ('at = "small_end"', 'at = "small_end"\nreference = [0,0,0]', "an interface has its own"),
    ("ratio = 0.01", "ratio = 1.5", "damping.ratio = 1.5"),
    ("ratio = 0.01", "ratio = 0.5", "damping: ratio = 0.5: this is 50 % of critical damping; expected at most 0.2."),
        ("ratio = 0.01", "ratios = [0.01, -1]", "damping.ratios = [0.01, -1]: expected a list of numbers, 0 to 1"),
    ("ratio = 0.01", "ramp = false", "damping.ramp = false: expected true, or pairs"),
    ("ratio = 0.01", "ramp = [[100, 0.1], [50, 0.2]]", "expected true, or pairs [frequency in Hz, ratio below it]"),
    ("ratio = 0.01", "ramp = [[100, -0.1]]", "expected true, or pairs [frequency in Hz, ratio below it]"),
    ("ratio = 0.01", "ratio = 0.01\nabove = 1", "damping: above belongs to ramp; got ratio"),
    ("ratio = 0.01", "ratio = 0.01\nramp = true", "expected either ratio, ratios, ramp, alpha and beta, or file; got"),
    ('at = "big_end"', "dofs = [[0, 0]]", "expected six pairs [node, component 0-5], nodes counted from 0"),
    ('at = "big_end"', "dofs = [[0,0],[0,1],[0,2],[1,0],[1,1],[1,6]]", "expected six pairs [node, component 0-5]"),
    ('at = "big_end"', 'at = "big_end"\ndofs = [[0,0],[0,1],[0,2],[1,0],[1,1],[2,0]]', "without at; got at = "),
    ('at = "big_end"', "axes = [[1, 0, 0]]", "reduction.axes = [[1, 0, 0]]: expected three rows"),
    ('[body]', '[body]\naccept = ["part"]', "'part' is not a finding that can be accepted; did you mean 'parts'?"),
    ('[body]', '[body]\nname = 3', "body.name = 3: expected the name of the body"),
    ('[body]', "body = 3\n[bodi]", "body = 3: expected a table [body]"),
])  # fmt: skip
def test_a_bad_job_is_refused_with_key_value_and_choices(job_file, old, new, words):
    assert GOOD.count(old) >= 1
    with pytest.raises(JobError) as caught:
        read_job(job_file(GOOD.replace(old, new, 1)))
    text = str(caught.value)
    assert words in text
    for jargon in ("pydantic", "http", "Value error", "type=", "Traceback"):
        assert jargon not in text


def test_all_problems_are_told_at_once(job_file):
    bad = GOOD.replace("young", "yuong").replace("rigid", "rigit").replace("= 12", "= -1")
    with pytest.raises(JobError) as caught:
        read_job(job_file(bad))
    lines = str(caught.value).splitlines()
    assert lines[0].endswith("rod.toml: 3 problems:")
    assert len(lines) == 4


@pytest.mark.parametrize(("options", "words"), [
    ('set = "benfield-hruda"', "reduction: mode set 'benfield-hruda' needs the mass or stiffness of the neighbours"),
    ('set = "rubin"\nloads = {big_end = {mass = 1}}', "mode set 'rubin' has no option loads; choices: cutoff, n_modes"),
    ('set = "rubin"\nfree = {big_end = ["rz"]}', "mode set 'rubin' has no option free"),
    ('set = "guyan"', "mode set 'guyan' has no option n_modes"),
    ('set = "craig-bampton-ir"\nn_modes = 3\ncutoff = 4.0', "expected either n_modes (how many) or cutoff"),
    ('set = "normal"\nn_modes = 0', "holds only rigid-body motion; choose n_modes >= 1"),
    ('free = {big_ent = ["rz"]}', "reduction.free.big_ent: there is no such interface; did you mean 'big_end'?"),
    ('free = {big_end = ["zr"]}', "reduction.free.big_end = ['zr']: unknown component 'zr'; choices: rx, ry"),
    ('free = {big_end = ["rz", "rz"]}', "expected a list of components, each once, of ux, uy, uz, rx, ry, rz"),
    ('free = {big_end = []}', "expected a list of components, each once"),
    (LOADED + "big_ent = {mass = 1}}", "reduction.loads.big_ent: there is no such interface; did you mean 'big_end'?"),
    (LOADED + "big_end = {mas = 1}}", "reduction.loads.big_end.mas: unknown key; did you mean 'mass'?"),
    (LOADED + "big_end = {}}", "reduction.loads.big_end: expected a mass, inertia, stiffness or rotational_stiffness"),
    (LOADED + "big_end = {mass = 0, stiffness = [0, 0, 0]}}", "expected a mass, inertia, stiffness or rotational_st"),
    (LOADED + "big_end = {mass = -1}}", "reduction.loads.big_end.mass = -1: expected one number, 0 or more"),
    (LOADED + "big_end = {mass = [1, 2, 3]}}", "mass: expected one number, or six rows of six numbers"),
    (LOADED + "big_end = {mass = [[1, 2], [3, 4]]}}", "expected one number, three, or six rows of six numbers"),
    (LOADED + "big_end = {inertia = [1, 2]}}", "expected one number, 0 or more, or three, [x, y, z]"),
    (LOADED + f"big_end = {{mass = {SIX_ROWS}, inertia = 2}}}}", "mass as six rows holds the inertia too"),
    ('set = "benfield-hruda"\nneighbours = [{job = "crank.toml", interfaces = {big_end = "pin"}}]', "no such file"),
    ('set = "benfield-hruda"\nneighbours = [{job = "rod.toml", interfaces = {}}]', "expected at least one pair"),
    ('set = "benfield-hruda"\nneighbours = [{job = "rod.toml", interfaces = {x = "pin"}}]',
     "reduction.neighbours.interfaces.x: there is no such interface"),
])  # fmt: skip
def test_options_that_do_not_fit_the_mode_set_are_refused(job_file, options, words):
    text = GOOD.replace("n_modes = 12", options if "n_modes" in options else f"{options}\nn_modes = 12")
    with pytest.raises(JobError) as caught:
        read_job(job_file(text))
    assert words in str(caught.value)


def test_loads_are_numbers_or_matrices(job_file):
    text = GOOD.replace(
        "n_modes = 12", LOADED + f"big_end = {{mass = 2, inertia = [1, 2, 3], stiffness = {SIX_ROWS}}}}}"
    )
    loads = read_job(job_file(text.replace("set =", "n_modes = 12\nset ="))).reduction.loads
    load = load_of("big_end", loads["big_end"])
    assert_array_equal(load.M, np.diag([2, 2, 2, 1, 2, 3]))
    assert_array_equal(load.K, np.eye(6))


def test_a_file_that_is_no_toml_is_refused_with_its_place(job_file, tmp_path):
    with pytest.raises(JobError, match=r"not valid TOML: .*line 3"):
        read_job(job_file("[body]\nname = 'x'\nmesh = = 3\n"))
    (tmp_path / "rod.toml").write_bytes(b"\x89HDF\xff\xfe")
    with pytest.raises(JobError, match="expected a text file"):
        read_job(tmp_path / "rod.toml")
    with pytest.raises(JobError, match=r"no such file; did you mean 'rod\.toml'"):
        read_job(tmp_path / "rot.toml")
    with pytest.raises(JobError, match="cannot be read"):
        read_job(tmp_path)


def test_matrices_bring_their_interfaces_and_no_material(job_file, tmp_path):
    (tmp_path / "rod.npz").touch()
    matrices = GOOD.replace("mesh", "matrices").replace("rod.msh", "rod.npz")
    with pytest.raises(JobError, match="matrices have their material inside"):
        read_job(job_file(matrices))
    text = '[body]\nmatrices = "rod.npz"\nunits = "m-kg-s"\n[reduction]\ncutoff = 100\n'
    assert read_job(job_file(text)).reduction.cutoff == 100.0
    with pytest.raises(JobError, match="matrices bring their interfaces"):
        read_job(job_file(text + '[interfaces.a]\nkind = "nodes"\nnodes = "left"\n'))


def test_dampings_and_frames_of_a_job_are_those_of_the_library(job_file):
    def damping(text):
        return read_job(job_file(GOOD.replace("ratio = 0.01", text))).damping.damping

    assert damping("ratio = 0.02") == ModalDamping(0.02)
    assert damping("ratios = [0.01, 0.02]") == PerModeDamping((0.01, 0.02))
    assert damping("ramp = true") == RampDamping(((100.0, 0.01), (1000.0, 0.1)), 1.0)
    assert damping("ramp = [[50, 0.02]]\nabove = 0.5") == RampDamping(((50.0, 0.02),), 0.5)
    assert damping("ratios = [0.01, 0.3]\nheavy = true") == PerModeDamping((0.01, 0.3), heavy=True)
    assert damping("beta = 1e-5") == RayleighDamping(0.0, 1e-5)
    turned = "axes = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]"
    job = read_job(
        job_file(GOOD.replace('frame = "nodal"\nat = "big_end"', f'frame = "buckens"\n{turned}\nstress = false'))
    )
    axes = ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    assert frame_of(job) == BuckensFrame(axes=axes)
    assert job.reduction.stress is False
    assert frame_of(read_job(job_file(GOOD))) == NodalFrame("big_end")
    dofs = "dofs = [[0,0],[0,1],[0,2],[1,0],[1,1],[2,0]]"
    held = frame_of(read_job(job_file(GOOD.replace('at = "big_end"', dofs))))
    assert held == NodalFrame(dofs=((0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (2, 0)))


def test_the_documented_job_is_valid(job_file):
    text = DOCUMENT.read_text(encoding="utf-8")
    block = "\n".join(line.removeprefix("    ") for line in text.splitlines() if line.startswith("    "))
    assert read_job(job_file(block)).interfaces["small_end"].cylinder.radius == 10.0

"""A body in parts, joined again: the same body as long as the cuts do not change it."""

import re
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

import cms
from cms.cli.split import SplitRequest, split_job
from cms.errors import CmsError, JobError
from cms.jobs.body_of_job import job_body
from cms.jobs.job import read_job
from cms.modes.families.families import Families
from cms.pipeline import reduce_job
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from floatframe import GeneralizedAlpha, integrate, linearize, static_equilibrium, system_modes
from floatframe.files.system_file.read_system import read_system
from floatframe.results.place_motion import interface_motion
from tests.bodies import box_mesh
from tests.cms.command import run_cms
from tests.decks import write_deck

BEAM = """
# a mast
[body]
nodes = "nodes.csv"
lines = "lines.csv"
units = "m-kg-s"

[materials.steel]   # of everything
young = 210e9
poisson = 0.3
density = 7850

[sections.mast]
shape = "tube"
radius = 0.03
thickness = 0.004

[masses.bob]
node = "bob"
mass = 2.0
inertia = 0.01

[load_cases.weight]
kind = "gravity"
acceleration = [0, 0, -9.81]

[interfaces.foot]
kind = "nodes"
nodes = "foot"

[interfaces.tip]
kind = "nodes"
nodes = "tip"

[reduction]
set = "craig-bampton"
n_modes = {n_modes}
frame = "nodal"
at = "foot"
"""


@pytest.fixture
def beam(tmp_path):
    def write(n_modes=12, bob=5):
        names = {0: "foot", 12: "tip"} | {bob: "bob"}
        rows = "".join(f"{i},{0.15 * i},0,{0.004 * i**2},{names.get(i, '')}\n" for i in range(13))
        (tmp_path / "nodes.csv").write_text("node,x,y,z,sets\n" + rows)
        (tmp_path / "lines.csv").write_text("node1,node2\n" + "".join(f"{i},{i + 1}\n" for i in range(12)))
        (tmp_path / "mast.toml").write_text(BEAM.format(n_modes=n_modes))
        return tmp_path / "mast.toml"

    return write


def reduced_parts(files):
    for path in files[:-1]:
        cms.write(reduce_job(read_job(path)), path.with_suffix(".h5"))
    return read_system(files[-1])[0]


def test_beam_in_parts_is_the_whole_beam(beam):
    """All modes of the parts: the same discrete model, so the same frequencies."""
    job = beam(n_modes=17)
    files = split_job(SplitRequest(job, 3))
    system = reduced_parts(files)
    with Families(job_body(read_job(job))) as families:
        exact = families.free_modes(n_modes=6).frequencies
    free = linearize(system, static_equilibrium(system))
    found = system_modes(free).natural_frequencies
    assert_allclose(np.sort(found)[-len(found) + 6 :][:6], exact, rtol=1e-5)


def test_parts_keep_what_is_theirs(beam):
    job = beam()
    files = split_job(SplitRequest(job, 3))
    assert [path.name for path in files] == ["part_1.toml", "part_2.toml", "part_3.toml", "system.toml"]
    parts = [read_job(path) for path in files[:-1]]
    assert [set(part.interfaces) for part in parts] == [{"foot", "cut_1"}, {"cut_1", "cut_2"}, {"tip", "cut_2"}]
    assert [(part.reduction.frame, part.reduction.at) for part in parts] == [("tisserand", None)] * 3
    assert [set(part.masses) for part in parts] == [set(), {"bob"}, set()]
    assert all(set(part.load_cases) == {"weight"} for part in parts)
    assert "[materials.steel]   # of everything" in files[0].read_text()
    masses = [reduce_job(part).moments.m for part in parts]
    assert_allclose(sum(masses), reduce_job(read_job(job)).moments.m, rtol=1e-12)


BLADE = 'shape = "rectangle"\nwidth = 0.02\nheight = 0.005\norientation = [0, 1, 0]'
SPIN = """
gravity = [0, 0, -9.81]
[joints.hub]
type = "revolute"
body_a = "ground"
body_b = "{body}"
marker_b = "foot"
axis = [0, 0, 1]
motions.angle = {{type = "cycloidal-spin-up", omega = 20, duration = 0.5}}
"""


def test_a_beam_of_stiffened_parts_spins_up_as_the_whole_one(beam):
    """A blade that sags by a twentieth of its length, which frames clamped at one end of each part do not carry."""
    job = beam(n_modes=8)
    job.with_name("nodes.csv").write_text(
        "node,x,y,z,sets\n" + "".join(f"{i},{i / 12},0,0,{({0: 'foot', 12: 'tip'}).get(i, '')}\n" for i in range(13))
    )
    text = job.read_text().replace('shape = "tube"\nradius = 0.03\nthickness = 0.004', BLADE)
    job.write_text(text[: text.index("[masses.bob]")] + text[text.index("[load_cases") :])
    files = split_job(SplitRequest(job, 3))
    reduced_parts(files)
    cms.write(reduce_job(read_job(job)), job.with_name("mast.h5"))
    whole = job.with_name("whole.toml")
    whole.write_text('[system]\nunits = "m-kg-s"' + SPIN.format(body="mast") + '[bodies.mast]\nfile = "mast.h5"\n')
    joined = files[-1].read_text().replace("gravity = [0, 0, 0]\n", SPIN.format(body="mast_1"))
    files[-1].write_text(joined)
    tips = []
    for path, name in ((whole, "mast"), (files[-1], "mast_3")):
        system = read_system(path)[0]
        motion = integrate(system, GeneralizedAlpha(0.8, 1e-8), 0.15, 1e-3)
        body = next(body for body in system.bodies if body.name == name)
        assert body.is_stiffened
        tips.append(interface_motion(motion, name, body.reduced, "tip").position)
    assert np.abs(tips[0][:, 2]).max() > 0.04
    assert_allclose(tips[1], tips[0], rtol=0, atol=2e-4)


def with_damping(job, table, frame="tisserand"):
    """The mast without its bob, with a damping table."""
    text = job.read_text()
    text = text[: text.index("[masses.bob]")] + text[text.index("[load_cases") :]
    if frame == "tisserand":
        text = text.replace('frame = "nodal"\nat = "foot"', 'frame = "tisserand"')
    job.write_text(text + f"\n[damping]\n{table}\n")
    return job


def told_modes(caplog):
    """Mode, frequency [Hz], ratio in parts and ratio of the job, and the number of modes that keep it."""
    (told,) = [text for text in caplog.messages if "ratios belong to modes of one body" in text]
    rows = np.array(re.findall(r"(\d+): ([\d.e+]+) Hz, ([\d.e-]+) for ([\d.e-]+)", told), dtype=float)
    first = re.search(r"with which the first (\d+) modes", told)
    return rows, len(rows) if first is None else int(first[1])


def modes_in_parts(files, held=False):
    """Frequencies and damping ratios of the joined parts, free or with the foot on the ground."""
    if held:
        files[-1].write_text(
            files[-1].read_text()
            + '\n[joints.foot]\ntype = "fixed"\nbody_a = "ground"\nbody_b = "mast_1"\nmarker_b = "foot"\n'
        )
    system = reduced_parts(files)
    modes = system_modes(linearize(system, static_equilibrium(system)))
    f, zeta = np.asarray(modes.frequencies), np.asarray(modes.damping_ratios)
    elastic = f > 1.0
    return f[elastic], zeta[elastic]


RATIO = ("ratio = 0.03", [0.03] * 6)
RATIOS = ("ratios = [0.03, 0.02, 0.04, 0.03]", [0.03, 0.02, 0.04, 0.03, 0.03, 0.03])
RAMP = ("ramp = [[2000, 0.03]]\nabove = 0.2", [0.03] * 6)


@pytest.mark.parametrize(
    ("table", "wanted", "frame"),
    [
        (*RATIO, "tisserand"),
        (*RATIOS, "nodal"),
        (*RAMP, "tisserand"),
        pytest.param(*RATIO, "nodal", marks=pytest.mark.long),
        pytest.param(*RATIOS, "tisserand", marks=pytest.mark.long),
        pytest.param(*RAMP, "nodal", marks=pytest.mark.long),
    ],
)
def test_modes_of_the_whole_keep_their_damping_ratios_in_parts(beam, caplog, table, wanted, frame):
    """Of the same modes as the whole body's, free in mean axes, clamped where a nodal frame is attached."""
    job = with_damping(beam(n_modes=14), table, frame)
    files = split_job(SplitRequest(job, 3))
    f, zeta = modes_in_parts(files, held=frame == "nodal")
    whole = reduce_job(read_job(job))
    omega = np.sqrt(np.diag(whole.K))
    assert_allclose(f[:6], omega[:6] / (2 * np.pi), rtol=1e-2)  # damping couples modes, which shifts |s|
    assert_allclose(np.diag(whole.D)[:6] / (2 * omega[:6]), wanted, rtol=1e-12)  # what the job asks for
    told, n_kept = told_modes(caplog)
    assert ("clamped at 'foot'" if frame == "nodal" else "'mast', free,") in caplog.text
    assert n_kept >= 4
    assert_allclose(zeta[:n_kept], wanted[:n_kept], rtol=5e-3)
    assert_allclose(told[:6, 3], wanted, rtol=1e-2)
    assert_allclose(told[:6, 2], zeta[:6], rtol=3e-2)
    assert_allclose(told[:6, 1], omega[:6] / (2 * np.pi), rtol=3e-3)  # of the whole with 14 modes


def test_the_error_of_the_ratios_in_parts_falls_with_more_modes(beam):
    errors = []
    for n_modes in (2, 5, 12):
        files = split_job(SplitRequest(with_damping(beam(n_modes=n_modes), "ratio = 0.03"), 3))
        _, zeta = modes_in_parts(files)
        errors.append(np.abs(zeta[:4] / 0.03 - 1).max())
    assert errors[0] > 4 * errors[1] > 16 * errors[2]
    assert errors[2] < 1e-4


def test_planar_parts_keep_ratios(beam, caplog):
    """Out of the plane each part is rigid, and its cuts have no dofs of their own there."""
    job = with_damping(beam(n_modes=14), "ratio = 0.03")
    job.write_text(job.read_text().replace('units = "m-kg-s"', 'units = "m-kg-s"\nplane = "xz"'))
    _, zeta = modes_in_parts(split_job(SplitRequest(job, 3)))
    told, n_kept = told_modes(caplog)
    assert n_kept == len(told) == 6
    assert_allclose(zeta[:6], 0.03, rtol=2e-3)


@pytest.mark.parametrize("cut", ["rigid", "distributing"])
def test_turned_solid_in_unequal_parts_keeps_ratios(tmp_path, caplog, cut):
    mesh = box_mesh(10, 1, 1, lx=1.2, ly=0.1, lz=0.12, kind="hexahedron20")
    turn = la.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    deck = write_deck(tmp_path / "bar.inp", replace(mesh, nodes=mesh.nodes @ turn.T + [3, -2, 5]))
    (tmp_path / "bar.toml").write_text(SOLID.format(mesh=deck.name, cut="", n_modes=20) + "[damping]\nratio = 0.02\n")
    along = turn[:, 0]
    places = tuple(np.array([0.36, 0.84]) + along @ [3, -2, 5])
    files = split_job(SplitRequest(tmp_path / "bar.toml", at=places, axis=tuple(along), kind=cut))
    _, zeta = modes_in_parts(files)
    _, n_kept = told_modes(caplog)
    assert n_kept >= 5
    assert_allclose(zeta[:n_kept], 0.02, rtol=2e-3)


def test_modes_of_one_frequency_keep_their_ratios_together(beam, caplog, monkeypatch):
    """The straight tube bends alike in two planes: its third and fourth mode are a pair."""
    job = with_damping(beam(n_modes=8), "ratio = 0.03")
    nodes = job.with_name("nodes.csv")
    nodes.write_text(re.sub(r",0,[\d.]+,", ",0,0,", nodes.read_text()))
    monkeypatch.setattr("cms.jobs.part_damping.BAND", 1.0)
    monkeypatch.setattr("cms.jobs.part_damping.FEWEST_MODES", 3)
    split_job(SplitRequest(job, 3))
    told, _ = told_modes(caplog)
    assert len(told) == 4
    assert_allclose(told[2, 1], told[3, 1], rtol=1e-3)


def test_damping_of_a_part_is_semidefinite_and_leaves_rigid_motion_free(beam):
    files = split_job(SplitRequest(with_damping(beam(n_modes=8), "ratio = 0.03"), 3))
    for path in files[:-1]:
        damping, body = read_job(path).damping.damping, job_body(read_job(path))
        moved = rigid_motion_of_dofs(body.nodes, body.dofs, body.nodes.mean(axis=0))
        size = np.abs(damping.forces).T @ np.abs(moved)
        assert_allclose(damping.forces.T @ moved / size, 0, atol=1e-10)
        reduced = reduce_job(read_job(path))
        ratio = la.eigvalsh(reduced.D, reduced.K)  # beta and more, in every strain
        assert ratio[0] > damping.beta * (1 - 1e-9)
        assert ratio[-1] < 2.1 * 4 * damping.beta * 20


def test_dampers_of_a_part_add_to_the_ratios(beam, caplog):
    spring = (
        '[springs.s]\nnodes = ["foot", "third"]\nstiffness = [0, 0, 0, 0, 0, 0]\ndamping = [0, 300, 300, 0, 0, 0]\n'
    )
    found = {}
    for name, ratio in (("damper", 0), ("both", 0.03)):
        job = with_damping(beam(n_modes=14, bob=3), f"ratio = {ratio}")
        job.with_name("nodes.csv").write_text(job.with_name("nodes.csv").read_text().replace("bob", "third"))
        job.write_text(job.read_text().replace("[load_cases.weight]", spring + "[load_cases.weight]"))
        found[name] = modes_in_parts(split_job(SplitRequest(job, 3)))[1][:5]
    assert found["damper"].max() > 1e-3
    assert_allclose(found["both"], 0.03 + found["damper"], rtol=1e-2)


def test_rayleigh_damping_of_the_whole_is_that_of_the_parts(beam, caplog):
    job = with_damping(beam(n_modes=14), "beta = 1e-5")
    files = split_job(SplitRequest(job, 3))
    f, zeta = modes_in_parts(files)
    assert_allclose(zeta[:4], np.pi * 1e-5 * f[:4], rtol=1e-3)
    assert not [text for text in caplog.messages if "ratios" in text]
    assert "beta = 1e-5" in files[0].read_text()


def test_ratios_that_parts_cannot_have_are_told(beam, caplog):
    """Eight parts of one or two elements have too few strains: the first modes keep their ratios, others have more."""
    job = with_damping(beam(n_modes=8), "ratio = 0.03")
    files = split_job(SplitRequest(job, 8))
    told, n_kept = told_modes(caplog)
    _, zeta = modes_in_parts(files)
    assert 1 <= n_kept < len(told)
    assert_allclose(zeta[:n_kept], 0.03, rtol=1e-2)
    assert_allclose(zeta[: len(told)], told[:, 2], rtol=5e-2)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace("at = [0.3", "at = [0.45"), "belongs to another body than 'mast_1': it has 18 dofs"),
        (lambda text: text.replace("part_1_damping", "part_3_damping"), "belongs to another body than 'mast_1'"),
        (lambda text: text.replace("part_1_damping.npz", "part_1.toml"), "expected a file that cms split wrote"),
        (lambda text: text.replace("part_1_damping", "part_9_damping"), "no such file"),
    ],
)  # fmt: skip
def test_damping_of_another_part_is_refused(beam, change, message):
    part = split_job(SplitRequest(with_damping(beam(n_modes=8), "ratio = 0.03"), at=(0.3, 0.9), axis=(1, 0, 0)))[0]
    part.write_text(change(part.read_text()))
    with pytest.raises(CmsError, match=message):
        reduce_job(read_job(part))


def test_a_light_body_of_few_modes_is_split(beam, caplog):
    """Two light beams between three masses without inertia: nine momenta, of which six are those of rigid motions."""
    job = beam(n_modes=1)
    for table, text in (
        ("nodes.csv", "node,x,y,z,sets\n0,0,0,0,foot\n1,1,0,0.3,\n2,2,0,0.5,bob\n3,3,0,0.4,\n4,4,0,0,tip\n"),
        ("lines.csv", "node1,node2\n0,1\n1,2\n2,3\n3,4\n"),
    ):
        job.with_name(table).write_text(text)
    masses = "".join(f'[masses.m{k}]\nnode = "{name}"\nmass = 2\n' for k, name in enumerate(("foot", "bob", "tip")))
    text = job.read_text()
    text = text[: text.index("[masses.bob]")] + masses + text[text.index("[load_cases") :]
    text = text.replace('frame = "nodal"\nat = "foot"', 'frame = "tisserand"')
    job.write_text(text.replace("density = 7850", "density = 0") + "\n[damping]\nratio = 0.03\n")
    split_job(SplitRequest(job, at=(1.0,), axis=(1.0, 0.0, 0.0)))
    with Families(job_body(read_job(job))) as families:
        f = families.free_modes(n_modes=3).frequencies
    told, _ = told_modes(caplog)
    assert_allclose(told[:, 1], f, rtol=1e-3)


def test_damping_of_parts_is_in_the_time_unit_of_the_job(beam):
    """The same beam in m-kg-s and in mm-kg-ms; limits of a ramp are in Hz in both."""
    dampings, words = [], []
    for units in ("m-kg-s", "mm-kg-ms"):
        job = beam(n_modes=8)
        text = job.read_text()
        text = text[: text.index("[masses.bob]")] + text[text.index("[load_cases") :]
        if units == "mm-kg-ms":
            table = job.with_name("nodes.csv")
            head, *rows = [line.split(",") for line in table.read_text().splitlines()]
            scaled = [[node, *(repr(1e3 * float(x)) for x in place), name] for node, *place, name in rows]
            table.write_text("".join(",".join(row) + "\n" for row in [head, *scaled]))
            for si, mm in (
                ("m-kg-s", units), ("210e9", "210"), ("7850", "7850e-9"), ("0.03", "30"), ("0.004", "4"),
                ("-9.81", "-9.81e-3"),
            ):  # fmt: skip
                text = text.replace(si, mm)
        job.write_text(f"{text}\n[damping]\nramp = [[5, 0.2]]\nabove = 0.03\n")
        part = split_job(SplitRequest(job, 3, folder=job.with_name(units)))[0]
        dampings.append(read_job(part).damping.damping)
        words += [line for line in part.read_text().splitlines() if "ratios belong to modes of one body" in line]
    assert_allclose(dampings[1].beta, 1e3 * dampings[0].beta, rtol=1e-6)
    assert_allclose(dampings[1].coefficients.max(), 1e3 * dampings[0].coefficients.max(), rtol=1e-3)
    assert words[0] == words[1]
    assert "for 0.03" in words[0]


SOLID = """
[body]
mesh = "{mesh}"
units = "m-kg-s"

[materials.steel]
young = 210e9
poisson = 0.3
density = 7850

[interfaces.left]
kind = "rigid"
nodes = "left"
{cut}
[interfaces.right]
kind = "rigid"
nodes = "right"

[reduction]
set = "craig-bampton"
n_modes = {n_modes}
frame = "tisserand"
"""


def test_solid_in_parts_is_the_whole_with_rigid_sections(tmp_path):
    deck = write_deck(tmp_path / "bar.inp", box_mesh(6, 1, 1, lx=1.2, ly=0.1, lz=0.1, kind="hexahedron20"))
    plane = '[interfaces.middle]\nkind = "rigid"\nbox = {lo = [0.6, 0, 0], hi = [0.6, 0.1, 0.1]}\n'
    (tmp_path / "whole.toml").write_text(SOLID.format(mesh=deck.name, cut=plane, n_modes=4))
    (tmp_path / "bar.toml").write_text(SOLID.format(mesh=deck.name, cut="", n_modes=40))
    with Families(job_body(read_job(tmp_path / "whole.toml"))) as families:
        exact = families.free_modes(n_modes=5).frequencies
    system = reduced_parts(split_job(SplitRequest(tmp_path / "bar.toml", 2)))
    found = np.sort(system_modes(linearize(system, static_equilibrium(system))).natural_frequencies)
    assert_allclose(found[6:11], exact, rtol=1e-4)


@pytest.mark.parametrize("seed", [0, 1, 2, *(pytest.param(k, marks=pytest.mark.long) for k in (3, 4, 5))])
def test_cells_with_their_centre_on_a_cut_are_in_the_same_part_of_split_and_job(tmp_path, seed):
    """The damping of a part belongs to its dofs; in a turned bar the last digit of the axis decides."""
    mesh = box_mesh(5, 1, 1, lx=1.0, ly=0.1, lz=0.12)
    turn = la.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    deck = write_deck(tmp_path / "bar.inp", replace(mesh, nodes=mesh.nodes @ turn.T))
    text = SOLID.format(mesh=deck.name, cut="", n_modes=4) + "[damping]\nratio = 0.02\n"
    (tmp_path / "bar.toml").write_text(text)
    parts = split_job(SplitRequest(tmp_path / "bar.toml", 2))[:-1]
    for part in parts:
        assert reduce_job(read_job(part)).D.any()


@pytest.mark.parametrize(
    ("change", "request_", "message"),
    [
        (lambda text: text, {"n": 2, "axis": (0, 1, 0)}, "no extent along"),
        (lambda text: text, {"n": 2, "kind": "nodes"}, "--cut nodes: expected one of rigid, distributing"),
        (lambda text: text.replace('node = "bob"', 'node = "foot"'), {"n": 40}, "has no cell"),
        (
            lambda text: text.replace('nodes = "tip"', 'box = {lo = [-1, -1, -1], hi = [9, 9, 9]}').replace(
                '[interfaces.tip]\nkind = "nodes"', '[interfaces.tip]\nkind = "rigid"'
            ),
            {"n": 2},
            "interfaces.tip: its 13 nodes do not lie on one part alone",
        ),
        (
            lambda text: text.replace('units = "m-kg-s"', 'units = "m-kg-s"\npart = {number = 1, of = 2}'),
            {"n": 2},
            "this is a part already",
        ),
    ],
)  # fmt: skip
def test_a_body_that_cannot_be_split_is_refused_and_nothing_written(beam, change, request_, message):
    job = beam()
    job.write_text(change(job.read_text()))
    with pytest.raises((JobError, ValueError), match=message):
        split_job(SplitRequest(job, **request_))
    assert not job.with_name("mast_parts").exists()


def test_a_mass_on_a_cut_is_refused(beam):
    job = beam(bob=6)
    with pytest.raises(JobError, match=r"masses\.bob: it is on a node of a cut"):
        split_job(SplitRequest(job, at=(0.9,), axis=(1, 0, 0)))


@pytest.mark.parametrize(
    ("part", "message"),
    [
        ("{number = 3, of = 2}", "there are 2 parts, got number 3"),
        ("{number = 1}", "expected either of or at, got neither"),
        ("{number = 1, of = 2, at = [0.5]}", "expected either of or at, got both"),
        ("{number = 1, at = 0.5}", "expected a list of numbers"),
    ],
)
def test_a_part_that_cannot_be_is_named(beam, part, message):
    job = beam()
    job.write_text(job.read_text().replace('units = "m-kg-s"', f'units = "m-kg-s"\npart = {part}'))
    with pytest.raises(JobError, match=message):
        read_job(job)


def test_command_splits_reduces_and_says_where(beam):
    job = beam(n_modes=2, bob=4)
    result = run_cms("split", job, "--at", "0.75", "--axis", "x", "-o", job.with_name("two"), "--reduce", code=0)
    for name in ("part_1.toml", "part_2.toml", "system.toml", "part_1.h5", "part_2.h5"):
        assert job.with_name("two").joinpath(name).is_file()
        assert name in result.output
    system, _ = read_system(job.with_name("two") / "system.toml")
    assert [joint.name for joint in system.joints] == ["cut_1"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--parts", "2", "--at", "0.5"], "either a number of parts or the places"),
        (["--at", "a,b"], "--at a,b: expected numbers"),
        (["--parts", "2", "--axis", "w"], "--axis"),
        (["--parts", "2", "-o", "mast.toml"], "this is a file; expected a folder"),
    ],
)
def test_command_names_the_option_that_is_wrong(beam, arguments, message, monkeypatch):
    job = beam()
    monkeypatch.chdir(job.parent)
    result = run_cms("split", job, *arguments, code=2)
    assert message in " ".join(result.output.split())


def test_names_that_toml_would_not_take_bare_and_groups_named_like_cuts(beam):
    job = beam(n_modes=2)
    text = job.read_text().replace("[body]", '[body]\nname = "my mast"').replace('"tip"', '"cut_tip"')
    job.write_text(text.replace("[interfaces.tip]", "[interfaces.cut_tip]"))
    (job.parent / "nodes.csv").write_text((job.parent / "nodes.csv").read_text().replace(",tip", ",cut_tip"))
    system = reduced_parts(split_job(SplitRequest(job, 2)))
    assert [body.name for body in system.bodies] == ["my mast_1", "my mast_2"]
    assert "cut_tip" in [interface.name for interface in system.bodies[1].reduced.interfaces]

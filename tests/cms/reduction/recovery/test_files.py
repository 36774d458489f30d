"""Recovery tables by a job, the command line and files: what is written is what stands in the body."""

import csv
import json

import numpy as np
import pytest
import scipy.io
from numpy.testing import assert_allclose

import cms
from cms.errors import RecoveryError
from cms.reduction.recovery.files import write_recovery
from cms.reduction.recovery.load_columns import forces_of_loads
from fe_models.files import read_table
from tests.cms.command import run_cms
from tests.cms.reduction.recovery.examples import reduced

JOB = """
[body]
nodes = "nodes.csv"
lines = "lines.csv"
units = "m-kg-s"

[materials.steel]
young = 2.1e11
poisson = 0.3
density = 7850.0

[sections.tube]
shape = "tube"
radius = 0.02
thickness = 0.003

[interfaces.root]
kind = "rigid"
nodes = [1]

[interfaces.tip]
kind = "rigid"
nodes = [5]

[reduction]
set = "craig-bampton"
n_modes = 4

[recovery.drm]
rows = [
    {quantity = "acceleration", at = [3, "tip"]},
    {quantity = "beam force", at = [12]},
    {quantity = "stress", at = 3, components = "xx"},
    {quantity = "interface force", at = "root"},
    {quantity = "net force", about = [0, 0, 0]},
]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A straight beam of four lines along x, nodes 1 to 5, lines 11 to 14."""
    folder = tmp_path_factory.mktemp("job")
    (folder / "nodes.csv").write_text("\n".join(["node,x,y,z", *(f"{k + 1},{0.25 * k},0,0" for k in range(5))]))
    (folder / "lines.csv").write_text("\n".join(["line,node1,node2", *(f"{11 + k},{k + 1},{k + 2}" for k in range(4))]))
    (folder / "beam.toml").write_text(JOB)
    return folder


def run(*words, code=0):
    result = run_cms(*words, code=code)
    return result.output


@pytest.fixture(scope="module")
def file(folder):
    cms.write(cms.reduce_job(folder / "beam.toml"), folder / "beam.h5")
    return folder / "beam.h5"


def test_a_job_asks_for_rows_by_numbers_of_its_mesh(file):
    table = cms.read(file).recovery["drm"]
    assert "node 3 acceleration uy" in table.labels
    assert "interface tip acceleration rz" in table.labels
    assert "element 12 beam force end B Mz" in table.labels
    skin = [label for label in table.labels if "stress" in label]
    assert skin[0].startswith("node 3 skin 1 stress")  # of the axis itself none is known
    assert {label.rpartition(" ")[2] for label in skin} == {"xx"}
    assert table.rows("interface force").size == 6


def test_section_forces_of_a_beam_are_those_of_statics(file):
    """Root held, a force at the tip: M = F (L - x), V and N constant along the beam."""
    body = cms.read(file)
    table = body.recovery["drm"]
    force = np.array([50.0, 7.0, -3.0])
    p = np.zeros(len(table.loads))
    first, root = table.loads.index("tip fx"), table.loads.index("root fx")
    p[first : first + 3] = force
    p[root : root + 3] = -force
    p[root + 3 : root + 6] = -np.cross([1.0, 0, 0], force)
    h = sum(interface.Psi.T @ p[k : k + 6] for interface, k in zip(body.interfaces, (root, first), strict=True))
    z = np.concatenate([np.zeros(6), h / np.diag(body.K)])
    y = table.values(z, p=p)
    found = {label.rpartition("force ")[2]: y[k] for k, label in enumerate(table.labels) if "element 12 " in label}
    for end, x in (("A", 0.25), ("B", 0.5)):
        arm = 1.0 - x
        mine = [found[f"end {end} {name}"] for name in ("N", "Mx")]
        assert_allclose(mine, [force[0], 0.0], rtol=1e-9, atol=1e-7)
        local = np.array([found[f"end {end} {name}"] for name in ("Vy", "Vz", "My", "Mz")])
        assert_allclose(np.linalg.norm(local[:2]), np.hypot(force[1], force[2]), rtol=1e-9)
        assert_allclose(np.linalg.norm(local[2:]), arm * np.hypot(force[1], force[2]), rtol=1e-9)


@pytest.mark.parametrize("over", ["modes", "interfaces"])
def test_all_formats_hold_the_same_matrices(tmp_path, over):
    body = reduced("craig-bampton", "turned")
    for suffix in ("npz", "mat", "op4", "csv"):
        write_recovery(body, tmp_path / f"all.{suffix}", over=over)
    npz = np.load(tmp_path / "all.npz")
    mat = scipy.io.loadmat(tmp_path / "all.mat")
    op4 = pytest.importorskip("pyyeti.nastran.op4").load(str(tmp_path / "all.op4"))
    table = body.recovery["all"]
    if over == "modes":
        np.testing.assert_array_equal(npz["acceleration"], table.dynamic[2])
        np.testing.assert_array_equal(npz["load"], table.static)
    names = {"displacement": "drmd", "velocity": "drmv", "acceleration": "drma", "load": "drmf", "M": "mxx", "K": "kxx"}
    for name, short in names.items():
        np.testing.assert_array_equal(mat[name], npz[name])
        np.testing.assert_array_equal(op4[short][0], npz[name])
    assert tuple(npz["labels"]) == table.labels
    assert tuple(str(cell[0][0]) for cell in mat["units"]) == table.units
    with open(tmp_path / "all_rows.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["label"] for row in rows] == list(table.labels)
    assert [row["unit"] for row in rows] == list(table.units)
    with open(tmp_path / "all.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    for suffix in ("json", "parquet"):
        write_recovery(body, tmp_path / f"all.{suffix}", over=over)
        again = read_table(tmp_path / f"all.{suffix}")
        assert again.meta["name"] == "all"
        for name in ("displacement", "acceleration"):
            columns = [again[key] for key in again.names if key.startswith(f"{name}: ")]
            np.testing.assert_array_equal(np.transpose(columns), npz[name])
    if over == "modes":
        assert again.heads == table.to_table().heads
    column = next(key for key in rows[0] if key.startswith("acceleration: "))
    assert [float(row[column]) for row in rows] == npz["acceleration"][:, 0].tolist()
    assert len(rows[0]) == 6 + sum(npz[name].shape[1] for name in ("displacement", "velocity", "acceleration", "load"))


def test_rows_over_interfaces_say_the_same_of_a_free_motion():
    """(u_b, eta) and the loads, against z and the loads with the forces at the interfaces that the motion needs."""
    body = reduced("craig-bampton", "turned")
    table = body.recovery["all"]
    assert table.loads[-3:] == ("node index 20 fx", "node index 20 fy", "node index 20 fz")
    matrices = cms.reduction.craig_bampton_matrices(body)
    rows = matrices.recover(table)
    rng = np.random.default_rng(8)
    motion = [rng.standard_normal(len(matrices.M)) * 1e-3 for _ in range(3)]
    p = rng.standard_normal(len(rows.loads))
    check_rows(body, matrices, rows, motion, p)
    at_node = np.array([name.startswith("node index 20 ") for name in rows.loads])
    assert at_node.sum() == 3
    still = [np.zeros(len(matrices.M))] * 3
    check_rows(body, matrices, rows, still, np.where(at_node, p, 0.0))  # the loads at a node alone


def check_rows(body, matrices, rows, motion, p):
    """Rows over (u_b, eta) and loads against rows over z, the loads and the interface forces of that motion."""
    table = rows.table
    y, y_dot, y_ddot = motion
    z, z_dot, z_ddot = (matrices.T @ each for each in (y, y_dot, y_ddot))
    at = {name: value for name, value in zip(rows.loads, p, strict=True)}
    whole = np.array([at.get(name, 0.0) for name in table.loads])
    force = table.values(z, z_dot, z_ddot, whole)[table.rows("interface force")]
    A = body.frame.axes
    for k, name in enumerate(("left", "right")):
        first = table.loads.index(f"{name} fx")
        own = force[6 * k : 6 * k + 6]
        whole[first : first + 6] = np.concatenate([A.T @ own[:3], A.T @ own[3:]])
    expected = table.values(z, z_dot, z_ddot, whole)
    found = rows.values(y, y_dot, y_ddot, p)
    scale = np.array([np.abs(found[table.rows(q)]).max() or 1.0 for q in table.quantities])
    assert_allclose(found / scale, expected / scale, rtol=0, atol=1e-8)


def test_the_work_of_a_load_at_a_node_is_that_of_the_full_model():
    """Interface forces at rest, -Zᵀ G: their static rows are of the full model, G here of the nodes that are kept."""
    body = reduced("craig-bampton", "turned")
    table, matrices = body.recovery["all"], cms.reduction.craig_bampton_matrices(body)
    names = table.loads[-3:]
    G = forces_of_loads(body, names)
    held = table.static[table.rows("interface force")][:, [table.loads.index(name) for name in names]]
    assert_allclose(-(matrices.T.T @ G)[: matrices.n_b], held, rtol=0, atol=1e-10)


def test_loads_at_nodes_that_are_not_kept_are_refused():
    body = reduced("craig-bampton", "turned")
    table = body.recovery["all"]
    lost = cms.body.RecoveryTable(**{**table.__dict__, "loads": (*table.loads[:-1], "node index 9999 fz")})
    with pytest.raises(RecoveryError, match="load 'node index 9999 fz': its work on the modes is unknown"):
        cms.reduction.craig_bampton_matrices(body).recover(lost)


def test_the_rigid_part_is_what_pyyeti_finds():
    """cbcheck: rigid-body mass, no force of the stiffness in a rigid motion, effective mass of the fixed modes."""
    cb = pytest.importorskip("pyyeti.cb")
    body = reduced("craig-bampton", "turned")
    matrices = cms.reduction.craig_bampton_matrices(body)
    left = matrices.rigid[:6]
    assert_allclose(left[:3, :3], np.eye(3), atol=0)
    places = np.array([full_place(body, name) for name in ("left", "right")])
    from pyyeti.nastran import n2p

    uset = n2p.addgrid(None, [1, 2], "b", 0, places, 0)
    rigid = n2p.rbgeom_uset(uset, (0.0, 0.0, 0.0))
    assert_allclose(matrices.rigid, rigid, rtol=0, atol=1e-14)
    b = slice(matrices.n_b)
    assert_allclose(matrices.K[b, b] @ rigid, 0.0, atol=1e-9 * np.abs(matrices.K).max())
    mass, J0 = body.moments.m, rigid.T @ matrices.M[b, b] @ rigid
    assert_allclose(np.diag(J0)[:3], mass, rtol=1e-9)
    assert_allclose(matrices.M_rigid, J0, rtol=1e-12, atol=1e-12)
    assert hasattr(cb, "cbcheck")


def full_place(body, name):
    interface = body.interface(name)
    return body.frame.origin + body.frame.axes @ interface.position


def test_the_command_lists_writes_and_adds_rows(file, tmp_path):
    text = run("recovery", file)
    assert "element 12 beam force end A N" in text
    out = run("recovery", file, "--over", "interfaces", "--units", "mm-t-s", "-o", tmp_path / "drm.op4")
    assert "op4 has no labels and units" in out
    assert (tmp_path / "drm_columns.csv").is_file()
    (tmp_path / "more.toml").write_text('[recovery.more]\nrows = [{quantity = "acceleration", at = "root"}]\n')
    run("recovery", file, "--rows", tmp_path / "more.toml", "-o", tmp_path / "more.h5")
    assert set(cms.read(tmp_path / "more.h5").recovery) == {"drm", "more"}
    several = run("recovery", tmp_path / "more.h5", "-o", tmp_path / "x.csv", code=2)
    assert "it has several recovery tables; name one of drm, more" in " ".join(several.split())
    record = json.loads(run("info", file, "--json"))
    assert record["recovery"][0]["quantities"]["beam force"] == 12
    assert "Recovery tables" in run("info", file)


def test_the_check_sees_rows_of_another_place_and_of_another_body(file, tmp_path):
    body = cms.read(file)
    names = {record.name: record.verdict for record in cms.check_body(body)}
    assert (names["recovery-motions"], names["recovery-forces"]) == ("pass", "pass")
    table = body.recovery["drm"]
    dynamic = np.array(table.dynamic)
    dynamic[2, 0, 5] += 0.01
    dynamic[0, table.rows("beam force")[0], 1] = 1e6
    wrong = cms.body.RecoveryTable(**{**table.__dict__, "dynamic": dynamic})
    records = cms.check_body(cms.ReducedBody(**{**body.__dict__, "recovery": {"drm": wrong}}))
    names = {record.name: record.verdict for record in records}
    assert (names["recovery-motions"], names["recovery-forces"]) == ("fail", "fail")


BAD = {
    '"beem force", at = [1]': ('"beam force", at = [12]', "beam force"),
    '"beam force", at = [77]': ('"beam force", at = [12]', "no element, set or part '77'"),
    '"shell resultant"': ('"beam force", at = [12]', "it has no such elements; it has beam force, beam strain"),
    'at = [33, "tip"]': ('at = [3, "tip"]', "no node 33"),
    'at = ["tipp"]': ('at = [3, "tip"]', "did you mean 'tip'"),
    'components = "xz "': ('components = "xx"', "no component"),
    'quantity = "net force"}': ('quantity = "net force", about = [0, 0, 0]}', "about is missing"),
    '"interface force", at = "rot"': ('"interface force", at = "root"', "no interface 'rot'"),
    "loads_at = 99\nrows = [": ("rows = [", "no node 99"),
}


@pytest.mark.parametrize("new", list(BAD))
def test_bad_rows_are_one_message(folder, new):
    old, words = BAD[new]
    assert JOB.count(old) == 1
    (folder / "bad.toml").write_text(JOB.replace(old, new))
    with pytest.raises(cms.errors.CmsError, match=words) as error:
        cms.reduce_job(folder / "bad.toml")
    assert len(str(error.value).splitlines()) == 1


def test_bad_tables_and_files_are_refused(tmp_path):
    body = reduced("craig-bampton", "turned")
    table = body.recovery["all"]
    with pytest.raises(RecoveryError, match="unknown format"):
        write_recovery(body, tmp_path / "x.xls")
    with pytest.raises(RecoveryError, match="no recovery table 'al'"):
        write_recovery(body, tmp_path / "x.csv", table="al")
    with pytest.raises(RecoveryError, match="move only"):
        write_recovery(reduced("normal", "turned"), tmp_path / "x.csv", over="interfaces")
    with pytest.raises(cms.errors.CmsError, match="the label"):
        cms.body.RecoveryTable(**{**table.__dict__, "labels": (table.labels[0],) * table.n_rows})
    with pytest.raises(cms.errors.CmsError, match="dynamic"):
        cms.body.RecoveryTable(**{**table.__dict__, "dynamic": table.dynamic[:2]})
    with pytest.raises(cms.errors.CmsError, match="loads: expected"):
        table.values(np.zeros(6 + body.n_q), p=np.zeros(3))
    with pytest.raises(cms.errors.CmsError, match="no row 'node 3 velocty'"):
        table.rows("node 3 velocty")
    assert not list(tmp_path.iterdir())


def test_forces_of_a_driven_base_are_those_of_pyyeti():
    """Its frequency response of Craig-Bampton matrices on a moving boundary, beside our rows of the same motion."""
    cb = pytest.importorskip("pyyeti.cb")
    body = reduced("craig-bampton", "turned")
    matrices = cms.reduction.craig_bampton_matrices(body)
    rows = matrices.recover("all")
    n_b, frequencies = matrices.n_b, np.array([5.0, 60.0, 190.0, 400.0, 1500.0])
    motion = np.zeros((n_b, len(frequencies)))
    motion[:] = matrices.rigid @ np.array([1.0, -0.5, 2.0, 3.0, 1.0, -2.0])[:, None]  # both ends on one shaker
    with np.errstate(all="ignore"):
        found = cb.cbtf(matrices.M, matrices.D, matrices.K, motion, frequencies, np.arange(n_b))
    y = rows.values(found.d.T, found.v.T, found.a.T)
    force = y[:, rows.table.rows("interface force")]
    assert_allclose(force, found.frc.T, rtol=0, atol=1e-8 * np.abs(found.frc).max())
    net = y[:, rows.table.rows("net force")[:6]]
    from tests.cms.reduction.recovery.examples import POINT

    about = cms.reduction.craig_bampton_matrices(body, about=POINT).rigid
    assert_allclose(net, found.frc.T @ about, rtol=0, atol=1e-8 * np.abs(net).max())

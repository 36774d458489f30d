"""Mode sets from a job file, and the command that lists them in words."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.jobs.body_of_job import job_body
from cms.jobs.job import read_job
from cms.jobs.mode_set_of_job import job_mode_set
from cms.modes.families.interface_loads import condensed_load, point_load
from cms.modes.mode_sets import benfield_hruda, craig_bampton
from cms.pipeline import reduce_job
from tests.bodies import box_mesh
from tests.cms.command import run_cms
from tests.decks import JOB, write_deck

CLASSICAL = (
    "craig-bampton", "craig-bampton-ir", "herting", "rubin", "macneal", "craig-chang", "dual-craig-bampton",
    "attachment", "unrestrained-attachment", "normal",
)  # fmt: skip


@pytest.fixture
def folder(tmp_path):
    write_deck(tmp_path / "bar.inp", box_mesh(6, 2, 2, 100.0, 10.0, 10.0, "hexahedron"))
    (tmp_path / "bar.toml").write_text(JOB)
    return tmp_path


def with_reduction(folder, text):
    (folder / "bar.toml").write_text(JOB.replace("n_modes = 3", text))
    return folder / "bar.toml"


@pytest.mark.parametrize("name", CLASSICAL)
def test_every_classical_set_comes_from_a_job(folder, name):
    reduced = reduce_job(read_job(with_reduction(folder, f'set = "{name}"\nn_modes = 3')))
    assert reduced.provenance["mode set"] == name
    assert reduced.provenance["mode set n_modes"] == "3"
    exact = reduce_job(read_job(with_reduction(folder, 'set = "normal"\nn_modes = 1'))).free_frequencies[0]
    assert exact * (1 - 1e-9) < reduced.free_frequencies[0] < 1.01 * exact


def test_loads_of_a_job_are_those_of_python(folder):
    text = """set = "benfield-hruda"
n_modes = 3
[reduction.loads.right]
mass = 1e-4
inertia = [1e-3, 2e-3, 3e-3]
stiffness = 100.0
[reduction.loads.left]
rotational_stiffness = [0, 10, 0]
[reduction]""".removesuffix("[reduction]")
    path = folder / "bar.toml"
    path.write_text(JOB.replace("n_modes = 3\n", "").replace("\n[damping]", f"{text}\n[damping]"))
    job = read_job(path)
    body = job_body(job)
    loads = [
        point_load("right", mass=1e-4, inertia=(1e-3, 2e-3, 3e-3), stiffness=100.0),
        point_load("left", rotational_stiffness=(0, 10, 0)),
    ]
    expected = benfield_hruda(body, n_modes=3, loads=loads)
    assert_allclose(job_mode_set(body, job.reduction).frequencies, expected.frequencies, rtol=1e-12)


def test_a_neighbour_of_a_job_is_condensed(folder):
    (folder / "neighbour.toml").write_text(JOB)
    neighbours = 'neighbours = [{job = "neighbour.toml", interfaces = {right = "left"}}]'
    job = read_job(with_reduction(folder, f'set = "benfield-hruda"\nn_modes = 3\n{neighbours}'))
    body = job_body(job)
    load = condensed_load(job_body(read_job(folder / "neighbour.toml")), {"right": "left"})
    expected = benfield_hruda(body, n_modes=3, loads=[load])
    assert_allclose(job_mode_set(body, job.reduction).frequencies, expected.frequencies, rtol=1e-9)
    (folder / "neighbour.toml").write_text(JOB.replace('"mm-t-s"', '"mm-kg-s"\naccept = ["units"]'))
    result = run_cms("reduce", folder / "bar.toml", code=2)
    assert "the neighbour is in units mm-kg-s, body 'bar' in mm-t-s" in " ".join(result.output.split())


def test_free_components_of_a_job_are_those_of_python(folder):
    job = read_job(with_reduction(folder, 'n_modes = 3\nfree = {left = ["rz", "ry"]}'))
    body = job_body(job)
    modes = job_mode_set(body, job.reduction)
    assert modes.options["free"] == "left rz ry"
    expected = craig_bampton(body, n_modes=3, free={"left": ["rz", "ry"]})
    assert_allclose(modes.frequencies[12:], expected.frequencies[12:], rtol=1e-12)


def test_a_cutoff_below_the_first_mode_ends_in_one_message(folder):
    path = with_reduction(folder, 'set = "rubin"\ncutoff = 2.0')
    result = run_cms("reduce", path, code=2)
    assert "cutoff = 2 lies below the first elastic free mode of body 'bar'" in " ".join(result.output.split())
    assert not (folder / "bar.h5").exists()


def test_modes_lists_columns_shapes_order_and_frame_in_words(folder):
    result = run_cms("modes", with_reduction(folder, 'set = "craig-bampton-ir"\nn_modes = 3'), code=0)
    for words in (
        "mode set craig-bampton-ir: 21 columns", "constraint left ux", "inertia-relief rz", "fixed-interface 3",
        "6 rigid-body motions removed", "nodal at interface left", "by ascending frequency; static shapes last",
        "The free body (no frame held)",
    ):  # fmt: skip
        assert words in " ".join(result.output.split())
    assert sorted(p.name for p in folder.iterdir()) == ["bar.inp", "bar.toml"]


def test_modes_as_json_is_the_reduced_body(folder):
    path = with_reduction(folder, 'set = "rubin"\nn_modes = 2')
    result = run_cms("modes", path, "--json")
    record = json.loads(result.stdout)
    reduced = reduce_job(read_job(path))
    assert_allclose([mode["frequency_hz"] for mode in record["modes"]], reduced.frequencies, rtol=1e-9)
    assert [c["label"] for c in record["columns"]][6:9] == ["free 1", "free 2", "residual attachment left ux"]
    free = np.array([c["frequency_hz"] for c in record["columns"] if c["frequency_hz"] is not None])
    assert_allclose(free, reduced.free_frequencies[:2], rtol=1e-8)
    assert record["frame"]["kind"] == "nodal"
    assert not any(c["dropped"] for c in record["columns"])

"""Jobs with interfaces of very many dofs: what they cost is said before the work, and what does not fit is refused."""

import logging
import re

import meshio
import numpy as np
import pytest

from cms.cli.info import print_body
from cms.errors import BodyError, JobError, ModeSetError
from cms.jobs.job import read_job
from cms.modes.families import cost, families
from cms.pipeline import expected_columns, reduce_job
from tests.bodies import box_mesh

JOB = """
[body]
name = "block"
mesh = "block.vtu"
units = "m-kg-s"
[materials.steel]
young = 2.1e11
poisson = 0.3
density = 7850.0
[interfaces.end]
kind = "nodes"
plane = {point = [0, 0, 0], normal = [1, 0, 0]}
[interfaces.other]
kind = "rigid"
plane = {point = [1, 0, 0], normal = [1, 0, 0]}
[reduction]
n_modes = 2
"""


@pytest.fixture
def job(tmp_path, monkeypatch):
    """A function that writes the job with more lines and reads it; 45 dofs are many."""
    mesh = box_mesh(4, 4, 2, kind="hexahedron")
    meshio.Mesh(np.asarray(mesh.nodes), {kind: np.asarray(rows) for kind, rows in mesh.cells.items()}).write(
        tmp_path / "block.vtu"
    )
    monkeypatch.setattr(cost, "MANY", 45)

    def made(lines=""):
        path = tmp_path / "block.toml"
        path.write_text(JOB + lines)
        return read_job(path)

    return made


def test_the_cost_of_all_constraint_modes_is_told_once_before_the_work(job, monkeypatch, caplog):
    told = []
    fix = families.fix_interfaces
    monkeypatch.setattr(
        families, "fix_interfaces", lambda *given, **names: told.append(caplog.text) or fix(*given, **names)
    )
    with caplog.at_level(logging.WARNING):
        reduce_job(job("geometric_stiffness = false\n"))
    assert len(told) == 1
    assert "interface 'end' of 15 nodes has 45 boundary dofs" in told[0]
    assert "Consider interface reduction: interface_modes = 20 in [reduction]" in told[0]
    assert caplog.text == told[0]


def test_who_reduces_the_interface_is_told_nothing(job, caplog):
    with caplog.at_level(logging.WARNING):
        body = reduce_job(job("interface_modes = 4\n"))
    assert not caplog.records
    assert body.n_q == 10 + 6 + 2 - 6
    assert body.geometric.interfaces.shape == (2, 6, 12, 12)


def test_geometric_stiffness_without_room_is_refused_before_the_work(job, monkeypatch):
    monkeypatch.setattr(cost, "machine_memory", lambda: 1e6)
    monkeypatch.setattr(families, "fix_interfaces", lambda *_, **__: pytest.fail("worked before it looked"))
    with pytest.raises(BodyError, match=r"over about 53 modes.*interface_modes = 20 in \[reduction\]"):
        reduce_job(job("geometric_stiffness = true\n"))


def test_geometric_stiffness_that_is_very_large_is_left_out_with_a_note(job, monkeypatch, caplog, capsys):
    monkeypatch.setattr(cost, "UNASKED", 8.0 * 30 * 40**2)
    with caplog.at_level(logging.WARNING):
        body = reduce_job(job())
    assert body.geometric is None
    assert "left out: 30 unit loads over 53 modes" in body.provenance["geometric stiffness"]
    assert caplog.text.count("left out") == 1
    print_body(body)
    told = " ".join(capsys.readouterr().out.split())
    assert "none: left out for its size, see below" in told
    assert "Geometric stiffness left out: 30 unit loads over 53 modes would be" in told
    assert reduce_job(job("interface_modes = 4\n")).geometric is not None


def test_columns_are_counted_before_they_are_made(job):
    class Body:
        b = np.arange(51)

        class Nodes:
            kind, dofs = "nodes", np.arange(45)

        class Rigid:
            kind, dofs = "rigid", np.arange(6)

        interfaces = (Nodes, Rigid)

    assert expected_columns(job(), Body) == 53
    assert expected_columns(job("interface_modes = 20\n"), Body) == 34
    assert expected_columns(job('set = "normal"\n'), Body) == 2


def test_what_a_large_geometric_stiffness_costs_is_told_before_the_work(job, monkeypatch, caplog):
    monkeypatch.setattr(cost, "UNASKED", 8.0 * 24 * 40**2)
    told = []
    fix = families.fix_interfaces
    monkeypatch.setattr(
        families, "fix_interfaces", lambda *given, **names: told.append(caplog.text) or fix(*given, **names)
    )
    monkeypatch.setattr(cost, "MANY", 10_000)
    left_out = r"left out: 30 unit loads over 53 modes would be .*interface_modes = 20 in \[reduction\] leaves about 34"
    for lines, words in (
        ("", left_out),
        ("geometric_stiffness = true\n", r"of 30 unit loads over about 53 modes: .* GB in the file, .* processor time"),
        ('geometric_stiffness = ["other"]\n', r"of 24 unit loads over about 53 modes"),
    ):
        caplog.clear()
        with caplog.at_level(logging.WARNING):
            reduce_job(job(lines))
        assert re.search(words, told[-1])
        assert caplog.text == told[-1]  # and once


def test_columns_are_announced_up_to_the_dofs_of_the_body(job, monkeypatch, caplog):
    """The block has 75 nodes, of which 15 move with a reference node: 60 x 3 + 6 dofs."""
    size = 8.0 * 30 * 186**2
    monkeypatch.setattr(cost, "machine_memory", lambda: cost.HELD * size)
    monkeypatch.setattr(cost, "MANY", 10_000)
    for unasked, lines, told in (
        (size, "", ""),
        (size, "geometric_stiffness = true\n", ""),
        (size - 1, "", "left out: 30 unit loads over 186 modes"),
        (size - 1, "geometric_stiffness = true\n", "of 30 unit loads over about 186 modes"),
    ):
        monkeypatch.setattr(cost, "UNASKED", unasked)
        caplog.clear()
        asked = job(lines)
        asked = asked.model_copy(update={"reduction": asked.reduction.model_copy(update={"n_modes": 5000})})
        with caplog.at_level(logging.WARNING), pytest.raises(ModeSetError, match=r"n_modes = 5000.* interior dofs"):
            reduce_job(asked)
        assert told in caplog.text
        assert bool(told) == bool(caplog.text)


def test_a_job_names_the_interfaces_whose_loads_stiffen(job, capsys):
    body = reduce_job(job('geometric_stiffness = ["other"]\n'))
    assert body.geometric.is_loaded == (False, True)
    print_body(body)
    told = " ".join(capsys.readouterr().out.split())
    assert "loads at some interfaces, see below" in told
    assert "oads at interfaces end do not stiffen the body: geometric_stiffness names other" in told
    words = r"""reduction.geometric_stiffness = \["othre"\]: there is no such interface; did you mean 'other'"""
    with pytest.raises(JobError, match=words):
        reduce_job(job('geometric_stiffness = ["othre"]\n'))

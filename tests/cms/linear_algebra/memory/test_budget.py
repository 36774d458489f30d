"""Budgets of memory: sizes in words, the forecast, and jobs that are held to one."""

import gc
import re
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse.linalg import splu

import cms
from cms.errors import FactorizationError, MemoryBudgetError
from cms.linear_algebra.memory import budget
from cms.linear_algebra.memory.budget import (
    Peak,
    ReductionShape,
    columns_within,
    peak_of,
    reduction_peak,
    solver_within,
)
from cms.linear_algebra.memory.size import memory_bytes
from cms.linear_algebra.solvers import superlu
from cms.linear_algebra.solvers.factorization import factorize, lower_triangle
from cms.linear_algebra.sparse_cholesky.analysis import analyse
from cms.linear_algebra.sparse_cholesky.blocks import blocks_of
from cms.linear_algebra.sparse_cholesky.factor import CholeskyFactor
from fe_models.foundation.tall.on_disk import is_on_disk
from fe_models.foundation.threads import n_threads
from tests.bodies import bar
from tests.cms.command import run_cms
from tests.cms.linear_algebra.sparse_cholesky.examples import grid


@pytest.mark.parametrize(
    ("text", "size"),
    [("8GB", 8e9), ("800 MB", 8e8), ("1.5gb", 1.5e9), ("7.5GiB", 7.5 * 2**30), (3e9, 3e9), ("2e9", 2e9)],
)
def test_sizes_are_read_with_their_units(text, size):
    assert memory_bytes(text) == size


@pytest.mark.parametrize("text", ["8 G", "eight", "", "-2GB", "8GB 3", "8Gbit", "inf", "nan", True])
def test_what_is_no_size_is_refused(text):
    with pytest.raises(MemoryBudgetError, match=r"memory = .*(expected a number with a unit|unknown unit)"):
        memory_bytes(text)


def test_a_size_without_its_unit_is_taken_for_a_slip():
    with pytest.raises(MemoryBudgetError, match=r"is 8 bytes, less than any run takes; did you mean"):
        memory_bytes("8")


@pytest.mark.parametrize("threads", [1, 2])
def test_the_working_memory_of_fronts_is_what_the_factorisation_holds(threads, monkeypatch):
    """Arrays counted as they are made: with the factor on disk only what is at work or waits is there."""
    monkeypatch.setattr("cms.linear_algebra.sparse_cholesky.factor.n_threads", lambda: threads)
    A = lower_triangle(grid(18))
    fronts = analyse(A)
    said = 8 * blocks_of(fronts).n_working(threads, on_disk=True)
    CholeskyFactor(A, fronts=fronts, on_disk=True).close()  # what is kept for all factorisations is there
    held = min(traced_peak(lambda: CholeskyFactor(A, fronts=fronts, on_disk=True).close()) for _ in range(2))
    assert 0.8 * held < said < 1.1 * held


def traced_peak(function):
    """Return the largest memory held in a call; other work of the process may add to it."""
    gc.collect()
    tracemalloc.start()
    try:
        function()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.fixture
def peaks(monkeypatch):
    """Matrix and shape of a reduction, and its peaks in memory and on disk, of a process that holds 100 MB."""
    monkeypatch.setattr(budget, "resident_bytes", lambda: 1e8)
    A = lower_triangle(grid(16))
    shape = ReductionShape(n_dof=16**3, n_columns=20, n_modes=8, held=1e8)
    fronts = analyse(A)
    return shape, *(peak_of(shape, fronts, A.nnz, 1e8, on_disk=on_disk).most for on_disk in (False, True))


def test_the_factor_goes_to_disk_where_the_budget_says_so(peaks, caplog):
    shape, inside, outside = peaks
    assert outside < inside
    b = np.random.default_rng(0).standard_normal((16**3, 3))
    with factorize(grid(16), solver=solver_within(inside, shape)) as held:
        assert "factor in memory" in held.description
        x = held.solve(b)
    assert not caplog.records
    with factorize(grid(16), solver=solver_within((inside + outside) / 2, shape)) as held:
        assert "factor on disk" in held.description
        assert_allclose(held.solve(b), x, rtol=0, atol=1e-12 * np.abs(x).max())
    assert re.search(
        r"this needs \d+ MB, more than \d+ MB; it runs out of core: \d+ MB, and \d+ MB on disk", caplog.text
    )
    with pytest.raises(MemoryBudgetError, match="with its factor on disk"):
        factorize(grid(16), solver=solver_within(0.999 * outside, shape))


def test_what_fits_neither_way_is_refused_with_what_would_help(peaks):
    shape, _, _ = peaks
    with pytest.raises(
        MemoryBudgetError, match=r"memory = 60 MB: this needs .* with its factor on disk, .*or take fewer"
    ):
        factorize(grid(16), solver=solver_within(6e7, shape))
    assert not issubclass(MemoryBudgetError, FactorizationError)  # which bodies would take for a mechanism


def test_each_stage_holds_the_factor_as_it_is_stored_and_its_columns():
    """Panels as the factorisation made them; n dofs, 8 modes in blocks of 8, 20 columns."""
    A = lower_triangle(grid(10))
    fronts, n = analyse(A), 10**3
    made = CholeskyFactor(A, fronts=fronts)
    blocks = blocks_of(fronts)
    panels = [made._panels.of(k).nbytes for k in range(len(blocks))]
    assert len(panels) > n_threads()
    shape = ReductionShape(n_dof=n, n_columns=20, n_modes=8, held=3e8)
    in_hand = sum(sorted(panels)[-n_threads() :])
    for on_disk, factor, read in ((False, sum(panels), sum(panels)), (True, 0, in_hand)):
        peak = peak_of(shape, fronts, A.nnz, 1e8, on_disk=on_disk)
        working = 8 * blocks.n_working(n_threads(), on_disk=on_disk)
        assert peak.factorisation == pytest.approx(1e8 + 12 * A.nnz + working + factor, rel=1e-12)
        assert peak.modes == pytest.approx(1e8 + read + 8 * n * (4 * 8 + 8 * 8 + 12), rel=1e-12)
        assert peak.reduction == pytest.approx(3e8 + 8 * 6.2 * n * 20, rel=1e-12)


def test_columns_go_to_disk_where_they_do_not_fit_and_take_less_there(caplog):
    """1000 columns of 50 000 dofs: 0.4 GB an array; a few of them take more on disk than in memory."""
    shape = ReductionShape(n_dof=50_000, n_columns=1000, n_modes=20, held=1e8)
    inside, outside = reduction_peak(shape), reduction_peak(replace(shape, to_disk=True))
    assert inside == pytest.approx(1e8 + 6.2 * 4e8, rel=1e-12)
    assert outside == pytest.approx(1e8 + 54 * 8e6 + 4e8, rel=1e-12)
    assert columns_within(inside, shape) is shape
    assert not caplog.records
    stored = columns_within(0.999 * inside, shape)
    assert stored.to_disk
    assert "need 2.58 GB, more than 2.58 GB; stored on disk they need 932 MB" in caplog.text
    assert "interface_modes = 20 in [reduction]" in caplog.text
    fronts = analyse(lower_triangle(grid(6)))
    in_core, on_disk = (peak_of(each, fronts, 1, 1e8, on_disk=False) for each in (shape, stored))
    assert in_core.modes - on_disk.modes == pytest.approx(8 * 50_000 * (2 * 1000 - 4 * 20 - 8 * 8), rel=1e-12)
    assert not columns_within(1e6, replace(shape, n_columns=30)).to_disk


def test_a_job_with_columns_on_disk_gives_the_same_body(tmp_path, monkeypatch):
    monkeypatch.setattr("fe_models.foundation.tall.on_disk.LARGE", 0)
    job = write_job(tmp_path, 'memory = "20GB"')
    kept = cms.reduce_job(job)
    assert not is_on_disk(kept.Phi)
    monkeypatch.setattr("cms.pipeline.columns_within", lambda _, shape: replace(shape, to_disk=True))
    stored = cms.reduce_job(job)
    assert is_on_disk(stored.Phi)
    for name in ("K", "Phi", "free_frequencies"):
        expected = getattr(kept, name)
        assert_allclose(getattr(stored, name), expected, rtol=0, atol=1e-10 * np.abs(expected).max())


def test_the_largest_stage_is_the_peak():
    assert Peak(1.0, 3.0, 2.0).most == 3.0


def write_job(folder, line=""):
    body = bar(nx=6, ny=2, nz=2)
    ends = {f"interface/{end.name}/nodes": end.nodes for end in body.interfaces}
    np.savez(folder / "bar.npz", M=body.M.toarray(), K=body.K.toarray(), nodes=body.nodes, dofs=body.dofs, **ends)
    path = folder / "job.toml"
    path.write_text(f'[body]\nmatrices = "bar.npz"\nunits = "m-kg-s"\n[reduction]\nn_modes = 2\n{line}\n')
    return path


def test_a_job_takes_a_budget_and_gives_the_same_body(tmp_path):
    free = cms.reduce_job(write_job(tmp_path), solver="superlu")
    kept = cms.reduce_job(write_job(tmp_path, 'memory = "20GB"'))
    assert kept.provenance["mode set solver"].startswith("Cholesky")
    assert_allclose(kept.K, free.K, rtol=1e-8, atol=1e-8 * np.abs(free.K).max())
    with pytest.raises(MemoryBudgetError, match="this needs"):
        cms.reduce_job(write_job(tmp_path), memory=5.1e7)


@pytest.mark.parametrize(
    ("line", "arguments", "words"),
    [
        ('memory = "8 Gigs"', [], "unknown unit"),
        ("memory = 8", [], "expected a number with a unit"),
        ("", ["--memory", "lots"], "expected a number with a unit"),
        ("", ["--memory", "60MB"], "memory = 60 MB: this needs"),
        ("", ["--memory", "8GB", "--solver", "superlu"], "belongs to solver cholesky"),
        ("", ["--memory", "8GB", "--workers", "2"], "--memory: belongs to one job"),
        ('set = "multilevel"', ["--memory", "8GB", "--workers", "2"], "the tree of the set multilevel is not"),
    ],
)
def test_the_command_refuses_budgets_that_do_not_do_and_writes_nothing(tmp_path, line, arguments, words):
    job = write_job(tmp_path, line)
    before = sorted(tmp_path.iterdir())
    result = run_cms("reduce", job, *arguments, code=2)
    assert re.search(re.escape(words), " ".join(result.output.split()))
    assert sorted(tmp_path.iterdir()) == before


def test_what_superlu_takes_is_told_before_the_work(monkeypatch, caplog):
    told = []
    A = lower_triangle(grid(8))
    monkeypatch.setattr(superlu, "splu", lambda *given, **options: told.append(caplog.text) or splu(*given, **options))
    superlu.SuperLuFactor(A, definite=True)
    monkeypatch.setattr(superlu, "MANY", 100)
    superlu.SuperLuFactor(A, definite=True)
    assert told == ["", ""]  # few rows, or little work
    monkeypatch.setattr(superlu, "LONG", 0.0)
    superlu.SuperLuFactor(A, definite=True)
    fronts = analyse(A)
    words = f"SuperLU: 512 rows: about {2 * fronts.operations / 4e9 / 60:.2g} minutes"
    assert words in told[-1]
    assert 'or solver = "cholesky" (everywhere) takes a fraction' in told[-1]
    caplog.clear()
    superlu.SuperLuFactor(A, definite=False)
    assert "rigid interfaces instead of distributing ones" in told[-1]

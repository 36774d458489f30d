"""Cycles: the published example of ASTM E1049-85, other counters, histories that repeat, chunks, a closed damage."""

from collections import Counter

import numpy as np
import pytest
import rainflow
from numpy.testing import assert_allclose

from floatframe.durability.fatigue.criteria import Criterion
from floatframe.durability.fatigue.history_damage import count_histories
from floatframe.durability.fatigue.kernels.cycle_kernels import collect
from floatframe.durability.fatigue.load_blocks import LoadBlock
from floatframe.durability.fatigue.mean_stress import MeanStress
from floatframe.durability.fatigue.sn_curve import basquin_curve

#: ASTM E1049-85 (2017), figure 6: the history A to I, and the cycles of its table
ASTM = np.array([-2, 1, -3, 5, -1, 3, -4, 4, -2], dtype=float)
ASTM_CYCLES = {3: 0.5, 4: 1.5, 6: 0.5, 8: 1.0, 9: 0.5}  # range -> count


def counted(history, *, is_repeated=False, digits=9):
    """Counts by range and mean."""
    found: Counter = Counter()
    for a, b, n in collect(np.asarray(history, dtype=float), is_repeated):
        found[round(abs(a - b), digits) + 0.0, round((a + b) / 2, digits) + 0.0] += n
    return found


def narrow_history(n_t=3000, seed=0):
    t = np.arange(n_t)
    rng = np.random.default_rng(seed)
    return sum(np.sin(0.02 * (k + 1) * t + rng.uniform(0, 6)) / (k + 1) for k in range(6))


def test_the_example_of_the_standard():
    ranges: Counter = Counter()
    for (size, _), n in counted(ASTM).items():
        ranges[size] += n
    assert ranges == ASTM_CYCLES


@pytest.mark.parametrize("seed", range(40))
def test_residues_as_half_cycles_give_the_counts_of_another_program(seed):
    rng = np.random.default_rng(seed)
    history = np.round(rng.standard_normal(rng.integers(3, 200)), 1 if seed % 2 else 8)
    theirs: Counter = Counter()
    for size, mean, n, _, _ in rainflow.extract_cycles(history):
        if size > 0:
            theirs[round(size, 9) + 0.0, round(mean, 9) + 0.0] += n
    assert counted(history) == theirs


@pytest.mark.parametrize("seed", range(20))
def test_a_repeated_history_has_the_cycles_of_itself_begun_at_its_greatest_value(seed):
    """Second road (ASTM E1049, simplified rainflow): turned to its maximum and closed, no half cycle is left."""
    history = np.random.default_rng(seed).standard_normal(101)
    turned = np.roll(history, -int(np.argmax(history)))
    closed = counted(np.r_[turned, turned[0]])
    ours = counted(history, is_repeated=True)
    assert ours == closed
    assert all(n == round(n) for n in ours.values())


def test_repeating_adds_the_cycles_of_one_pass_each_time():
    history = np.random.default_rng(5).standard_normal(60)
    once = counted(history, is_repeated=True)
    many, more = (counted(np.tile(history, k)) for k in (6, 7))
    assert {key: more[key] - many[key] for key in more if more[key] != many[key]} == once


def test_chunks_and_tiles_change_nothing(monkeypatch):
    q = np.stack([narrow_history(seed=k) for k in range(3)], axis=1)
    stress = np.random.default_rng(0).standard_normal((5, 6, 3))
    curve = basquin_curve(1.0, 1e6, 5, least_cycles=1)
    whole = count_histories(stress, [LoadBlock("a", q)], curve, negligible=0)
    monkeypatch.setitem(count_histories.__globals__, "CHUNK", 7)
    assert_allclose(count_histories(stress, [LoadBlock("a", q)], curve, negligible=0).total, whole.total, rtol=1e-12)


@pytest.mark.parametrize("residue", ["half", "repeat"])
def test_streamed_damage_is_that_of_collected_cycles(residue):
    q = np.stack([narrow_history(seed=k) for k in range(2)], axis=1)
    stress = np.zeros((1, 6, 2))
    stress[0, 0] = [3.0, -1.0]
    curve = basquin_curve(2.0, 1e6, 5, below="haibach", least_cycles=1)
    found = count_histories(stress, [LoadBlock("a", q, repeats=7)], curve, residue=residue, negligible=0)
    cycles = collect(np.ascontiguousarray(q @ stress[0, 0]), residue == "repeat")
    expected = 7 * (cycles[:, 2] @ curve.damage(np.abs(cycles[:, 0] - cycles[:, 1]) / 2))
    assert_allclose(found.total, expected, rtol=1e-12)
    assert_allclose(found.cycles, 7 * cycles[:, 2].sum(), rtol=1e-12)


def test_constant_amplitude_and_two_blocks_in_closed_form():
    """n sines of amplitude S do n / N(S); a second block adds its own (Miner 1945); scale acts on the stress."""
    t = np.arange(8000) / 40  # 200 periods, maxima on the grid
    q = np.sin(2 * np.pi * t)[:, None]
    stress = np.zeros((1, 6, 1))
    stress[0, 0, 0] = 150.0
    curve = basquin_curve(100.0, 2e6, 5)
    blocks = [LoadBlock("one", q, t, repeats=30), LoadBlock("two", q[:4000], t[:4000], repeats=5, scale=2.0)]
    found = count_histories(stress, blocks, curve, negligible=0)
    expected = [30 * 200 * 1.5**5 / 2e6, 5 * 100 * 3.0**5 / 2e6]
    assert_allclose(found.damage[:, 0], expected, rtol=1e-12)


def test_a_mean_stress_enters_each_cycle():
    """Tension S_m + S_a sin: Goodman by hand."""
    t = np.arange(400) / 40
    q = np.stack([np.sin(2 * np.pi * t), np.ones(len(t))], axis=1)
    stress = np.zeros((1, 6, 2))
    stress[0, 0] = [90.0, 60.0]
    curve = basquin_curve(100.0, 2e6, 5)
    found = count_histories(stress, [LoadBlock("a", q)], curve, mean_stress=MeanStress("goodman", 600.0), negligible=0)
    assert_allclose(found.total, 10 * (90.0 / (1 - 60 / 600) / 100) ** 5 / 2e6, rtol=1e-12)
    assert_allclose(found.largest, 100.0, rtol=1e-12)


def test_compression_turns_the_sign_of_the_equivalent_stress():
    """A uniaxial stress between -s and +s has twice the range of the von Mises stress without sign."""
    q = np.sin(2 * np.pi * np.arange(400) / 40)[:, None]
    stress = np.zeros((1, 6, 1))
    stress[0, 2, 0] = 50.0
    curve = basquin_curve(100.0, 2e6, 5)
    for name in ("signed-von-mises", "principal"):
        found = count_histories(stress, [LoadBlock("a", q)], curve, criterion=Criterion(name), negligible=0)
        assert_allclose(found.largest, 50.0, rtol=1e-12)
        assert_allclose(found.cycles, 10)

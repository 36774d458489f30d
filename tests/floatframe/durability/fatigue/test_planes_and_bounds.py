"""Critical planes in closed form and by brute force; bounds that no node exceeds, and what is left out by them."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from floatframe.durability.fatigue.criteria import CRITERIA, Criterion, von_mises_root
from floatframe.durability.fatigue.history_damage import count_histories, damage_bounds, envelope, stress_bounds
from floatframe.durability.fatigue.kernels.cycle_kernels import collect
from floatframe.durability.fatigue.kernels.stress_kernels import largest_principal, signed_von_mises
from floatframe.durability.fatigue.load_blocks import LoadBlock
from floatframe.durability.fatigue.mean_stress import MeanStress
from floatframe.durability.fatigue.sn_curve import basquin_curve
from floatframe.errors import FatigueError

PERIOD = 720  #: times of one cycle
PHASE = 2 * np.pi * np.arange(4 * PERIOD) / PERIOD
CURVE = basquin_curve(100.0, 1e6, 5, least_cycles=1)
PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))


def tensor(components):
    """(6, n) -> (n, 3, 3)."""
    full = np.zeros((components.shape[1], 3, 3))
    for c, (i, j) in enumerate(PAIRS):
        full[:, i, j] = full[:, j, i] = components[c]
    return full


def rotation(seed):
    R = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]
    return R * np.sign(np.linalg.det(R))


def stress_of(matrix):
    """Components of a tensor of modes, (n_q, 3, 3) -> (1, 6, n_q)."""
    return np.array([[m[i, j] for m in matrix] for i, j in PAIRS])[None]


def largest(name, matrices, q, frame, *, n_planes=180, k=0.3):
    found = count_histories(
        stress_of(matrices), [LoadBlock("a", q)], CURVE, criterion=Criterion(name, n_planes=n_planes, findley_k=k),
        frames=frame[None], negligible=0,
    )  # fmt: skip
    assert_allclose(found.cycles, 4)
    assert_allclose(found.total, 4 * CURVE.damage(found.largest), rtol=1e-12)
    return float(found.largest[0])


PLANES = ["normal", "shear", "findley"]


@pytest.mark.parametrize(("name", "seed"), [
    pytest.param(name, seed, marks=() if seed == k else pytest.mark.long)
    for k, name in enumerate(PLANES) for seed in range(3)
])  # fmt: skip
def test_tension_and_torsion_out_of_phase(name, seed):
    """sigma cos wt and tau sin wt in the plane of the surface, by brute force over planes, any axes."""
    R = rotation(seed)  # columns: e1, e2, m
    sigma, tau, k = 120.0, 90.0, 0.3
    local = np.zeros((2, 3, 3))
    local[0, 0, 0], local[1, 0, 1], local[1, 1, 0] = sigma, tau, tau
    modes = R @ local @ R.T
    q = np.stack([np.cos(PHASE), np.sin(PHASE)], axis=1)
    best = 0.0
    for angle in np.deg2rad(np.arange(360)):
        c, along = np.array([np.cos(angle), np.sin(angle), 0]), np.array([-np.sin(angle), np.cos(angle), 0])
        m = np.eye(3)[2]
        planes = [(c, along), ((c + m) / math.sqrt(2), (c - m) / math.sqrt(2)), ((c + m) / math.sqrt(2), along)]
        for n, s in planes[:1] if name == "normal" else planes:
            traction = np.einsum("tk,kij,j->ti", q, local, n)
            shear, normal = np.ptp(traction @ s) / 2, (traction @ n).max()
            best = max(best, {"normal": normal, "shear": 2 * shear,
                              "findley": 2 * (shear + k * normal) / (k + math.sqrt(1 + k * k))}[name])  # fmt: skip
    assert_allclose(largest(name, modes, q, R.T, k=k), best, rtol=1e-9)


@pytest.mark.parametrize("name", ["normal", "shear", "findley"])
def test_tension_alone_gives_its_own_amplitude(name):
    """So that curves of bars under tension hold for every criterion; half a degree off the worst plane costs 1e-4."""
    modes = np.zeros((1, 3, 3))
    modes[0, 0, 0] = 80.0
    assert_allclose(largest(name, modes, np.sin(PHASE)[:, None], np.eye(3)), 80.0, rtol=1e-4)


@pytest.mark.parametrize(("name", "share"), [("normal", 1.0), ("shear", 2.0)])
def test_torsion_alone(name, share):
    modes = np.zeros((1, 3, 3))
    modes[0, 0, 1] = modes[0, 1, 0] = 50.0
    assert_allclose(largest(name, modes, np.sin(PHASE)[:, None], np.eye(3)), share * 50.0, rtol=1e-12)


def test_findley_of_nested_cycles_by_hand():
    """Shear 0 3 1 2 -3 0 with normal stress of its own: the inner cycle 1-2 knows only the normal stress meanwhile."""
    shear = np.array([0.0, 3, 1, 2, -3, 0])
    normal = np.array([0.0, 10, 0, 4, 2, 0])
    k = 0.3
    modes = np.zeros((2, 3, 3))
    modes[0, 0, 1] = modes[0, 1, 0] = 1.0  # shear on the plane n = e1
    modes[1, 0, 0] = 1.0
    q = np.stack([shear, normal], axis=1)
    from floatframe.durability.fatigue.history_damage import Rule, count_block

    criterion = Criterion("findley", n_planes=4, findley_k=k)
    rows = criterion.rows(stress_of(modes), np.eye(3)[None])
    rule = Rule(CURVE, MeanStress(), criterion, "repeat", (1.0,))
    damage, counts, _ = count_block(rows, np.ascontiguousarray(q.T), rule)
    S = [2 * (tau_a + k * high) / (k + math.sqrt(1 + k * k)) for tau_a, high in ((0.5, 4), (3, 10))]
    assert_allclose(counts[0, 0, 0], 2)
    assert_allclose(damage[0, 0], CURVE.damage(np.array(S)).sum(), rtol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_scalars_are_those_of_the_eigenvalues(seed):
    rng = np.random.default_rng(seed)
    stress = rng.standard_normal((1, 6, 400))
    stress[0, 2:5, :100] = 0  # plane
    stress[0, 1:, 100:150] = 0  # uniaxial
    values = np.linalg.eigvalsh(tensor(stress[0]))
    principal = np.where(values[:, 2] >= -values[:, 0], values[:, 2], values[:, 0])
    s1, s2, s3 = values.T
    mises = np.sqrt(((s1 - s2) ** 2 + (s2 - s3) ** 2 + (s3 - s1) ** 2) / 2)
    out = np.empty((1, 400))
    signed_von_mises(stress, out)
    assert_allclose(out[0], np.sign(principal) * mises, rtol=0, atol=1e-13)
    largest_principal(stress, out)
    assert_allclose(out[0], principal, rtol=0, atol=1e-13)
    assert_allclose(np.linalg.norm(von_mises_root() @ stress[0], axis=0), mises, rtol=0, atol=1e-13)


@pytest.mark.parametrize("name", ["signed-von-mises", "principal"])
def test_stress_in_the_surface_is_the_whole_of_a_free_surface(name):
    R = rotation(7)
    rng = np.random.default_rng(1)
    local = np.zeros((3, 3, 3))
    local[:, :2, :2] = rng.standard_normal((3, 2, 2))
    local += local.transpose(0, 2, 1)
    stress, q = stress_of(R @ local @ R.T), 100 * rng.standard_normal((500, 3))
    args = {"frames": R.T[None], "negligible": 0}
    full, plane = (count_histories(stress, [LoadBlock("a", q)], CURVE, criterion=Criterion(name, tensor), **args)
                   for tensor in ("full", "surface"))  # fmt: skip
    assert_allclose(plane.total, full.total, rtol=1e-10)


def histories(seed, n_t=400, n_q=4):
    """Smooth, white, and with rare peaks; a rank deficient one."""
    rng = np.random.default_rng(seed)
    white = rng.standard_normal((n_t, n_q))
    return [
        np.cumsum(white, axis=0) / 8,
        white * np.array([1, 1e-3, 5, 0]),
        white**5,
        np.outer(rng.standard_normal(n_t), rng.standard_normal(n_q)),
    ][seed % 4]


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(k, marks=pytest.mark.long) for k in (2, 3))])
@pytest.mark.parametrize("name", CRITERIA)
def test_no_node_exceeds_its_bound(name, seed):
    """Each kind of history by every criterion."""
    laws = [MeanStress(), MeanStress("goodman", 3000.0), MeanStress("gerber", 3000.0), MeanStress("swt"),
            MeanStress("walker", 0.3), MeanStress("fkm", 0.9), MeanStress("soderberg", 20.0)]  # fmt: skip
    rng = np.random.default_rng(seed)
    stress = rng.standard_normal((30, 6, 4)) * np.exp(2 * rng.standard_normal((30, 1, 1)))
    frames = np.stack([rotation(k).T for k in range(30)])
    blocks = [LoadBlock("a", histories(seed), repeats=3), LoadBlock("b", histories(seed + 1), scale=-2.0)]
    for law in laws if name not in ("shear", "findley") else laws[:1]:
        for R, below in ((-1.0, "elementary"), (0.1, "haibach"), (-1.0, "limit")):
            curve = basquin_curve(20.0, 1e6, 4, below=below, stress_ratio=R, least_cycles=1)
            found = count_histories(
                stress, blocks, curve, criterion=Criterion(name, n_planes=6), mean_stress=law,
                residue=["half", "repeat"][seed % 2], frames=frames, negligible=0,
            )  # fmt: skip
            assert (found.total <= found.bound).all()


def test_the_bound_is_twice_the_damage_where_every_value_turns():
    """One mode, +1 -1 +1 ...: n_t values bound n_t / 2 cycles."""
    q = np.resize([1.0, -1.0], 1000)[:, None]
    stress = np.zeros((1, 6, 1))
    stress[0, 0, 0] = 50.0
    found = count_histories(stress, [LoadBlock("a", q)], CURVE, negligible=0)
    assert_allclose(found.bound / found.total, 2.0, rtol=0.05)
    assert found.bound >= 2 * found.total


@pytest.mark.parametrize("seed", range(3))
def test_what_is_left_out_is_below_the_share_and_the_rest_is_the_same(seed):
    rng = np.random.default_rng(seed)
    stress = rng.standard_normal((2000, 6, 4)) * np.exp(2 * rng.standard_normal((2000, 1, 1)))
    blocks = [LoadBlock("a", histories(seed))]
    all_of_them = count_histories(stress, blocks, CURVE, negligible=0)
    some = count_histories(stress, blocks, CURVE, negligible=1e-3)
    left = ~some.is_counted
    assert left.mean() > 0.5
    assert_array_equal(some.damage[:, ~left], all_of_them.damage[:, ~left])
    assert (all_of_them.total[left] <= 1e-3 * some.total[~left].max()).all()
    assert (all_of_them.total <= some.bound).all()


def test_a_mean_at_the_strength_has_no_bound():
    q = np.ones((10, 1))
    stress = np.full((1, 6, 1), 0.0)
    stress[0, 0, 0] = 400.0
    found = envelope(LoadBlock("a", q), 5.0)
    law = MeanStress("goodman", 300.0)
    assert damage_bounds(*stress_bounds(stress, found, Criterion()), found, Criterion(), CURVE, law)[0] == math.inf


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"residue": "open"}, "residue: unknown 'open'"),
        ({"negligible": 1.0}, "share from 0 to below 1"),
        ({"criterion": Criterion("findley"), "mean_stress": MeanStress("swt")}, "contains the normal stress"),
        ({"blocks": []}, "one load block"),
        ({"blocks": [LoadBlock("road", np.zeros((3, 2)))]}, "2 modal coordinates, but stress shapes of 4"),
    ],
)
def test_what_does_not_fit_is_refused(change, words):
    args = {"blocks": [LoadBlock("a", histories(0))], "curve": CURVE} | change
    with pytest.raises(FatigueError, match=words):
        count_histories(np.zeros((2, 6, 4)), args.pop("blocks"), args.pop("curve"), **args)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: LoadBlock("road", [[0.0], [math.nan], [1.0]], [0, 1, 2]), r"row 1, t = 1: a gap"),
        (lambda: LoadBlock("road", [[0.0], [1.0], [1.0]], [0, 1, 1]), r"got 1 and then 1 at row 2"),
        (lambda: LoadBlock("road", [[0.0], [1.0], [1.0]], [0, 2, 1]), r"got 2 and then 1 at row 2"),
        (lambda: LoadBlock("road", np.zeros((8, 1)), [0, 1, 2, 3, 40, 41, 42, 43]), r"a gap from 3 to 40, 37 times"),
        (lambda: LoadBlock("road", np.zeros((8, 1)), [0, 1]), r"expected 8 times"),
        (lambda: LoadBlock("road", np.zeros((1, 1))), r"two times or more"),
        (lambda: LoadBlock("road", np.zeros((8, 1)), repeats=0), r"repeats: expected a number above 0"),
        (lambda: LoadBlock("road", np.zeros((8, 1)), scale=math.nan), r"scale"),
        (lambda: Criterion("mises"), r"unknown criterion 'mises'"),
        (lambda: Criterion("normal", "surface"), r"not normal"),
        (lambda: Criterion("findley", findley_k=-1), r"findley_k"),
        (lambda: Criterion("normal", n_planes=2), r"4 to 360"),
    ],
)
def test_histories_with_gaps_and_unknown_criteria_are_refused(make, words):
    with pytest.raises(FatigueError, match=words):
        make()


def test_the_cycles_of_a_plane_history_are_those_of_its_projection():
    """A wavy history, normal stress on one plane of four: the damage of the collected cycles of n . sigma n."""
    q = histories(0)
    stress = np.random.default_rng(3).standard_normal((1, 6, 4))
    found = count_histories(stress, [LoadBlock("a", q)], CURVE, criterion=Criterion("normal", n_planes=4),
                            frames=np.eye(3)[None], negligible=0)  # fmt: skip
    damages = []
    for angle in np.pi * np.arange(4) / 4:
        n = np.array([np.cos(angle), np.sin(angle), 0])
        cycles = collect(np.einsum("i,tij,j->t", n, tensor(stress[0] @ q.T), n), True)
        damages.append(cycles[:, 2] @ CURVE.damage(np.abs(cycles[:, 0] - cycles[:, 1]) / 2))
    assert_allclose(found.total[0], max(damages), rtol=1e-10)
    assert found.plane[0] == int(np.argmax(damages))


def test_findley_keeps_the_normal_stress_of_cycles_that_were_taken_out():
    """Shear 0 3 1 2 -3 0: the normal stress is greatest within the inner cycle, and the outer one knows it."""
    from floatframe.durability.fatigue.history_damage import Rule, count_block

    shear, normal = np.array([0.0, 3, 1, 2, -3, 0]), np.array([0.0, 0, 0, 7, 0, 0])
    k = 0.3
    modes = np.zeros((2, 3, 3))
    modes[0, 0, 1] = modes[0, 1, 0] = 1.0
    modes[1, 0, 0] = 1.0
    criterion = Criterion("findley", n_planes=4, findley_k=k)
    rows = criterion.rows(stress_of(modes), np.eye(3)[None])
    q = np.ascontiguousarray(np.stack([shear, normal]))
    damage, _, _ = count_block(rows, q, Rule(CURVE, MeanStress(), criterion, "half", (1.0,)))
    ranges = [(1.0, 1.0, 7.0), (3.0, 0.5, 0.0), (6.0, 0.5, 7.0), (3.0, 0.5, 0.0)]  # range, count, largest normal
    S = [2 * (size / 2 + k * high) / (k + math.sqrt(1 + k * k)) for size, _, high in ranges]
    assert_allclose(damage[0, 0], CURVE.damage(np.array(S)) @ [n for _, n, _ in ranges], rtol=1e-12)


def test_shear_out_of_a_surface_under_equal_tension_both_ways():
    """sigma e1 e1 + sigma e2 e2: no shear across the surface, sigma / 2 on every plane at 45 degrees to it."""
    modes = np.diag([70.0, 70.0, 0.0])[None]
    assert_allclose(largest("shear", modes, np.sin(PHASE)[:, None], np.eye(3)), 70.0, rtol=1e-12)


def test_bounds_add_up_over_repeats():
    q = histories(1)
    stress = np.random.default_rng(0).standard_normal((5, 6, 4))
    once, often = (count_histories(stress, [LoadBlock("a", q, repeats=n)], CURVE).bound for n in (1, 250))
    assert_allclose(often, 250 * once, rtol=1e-12)

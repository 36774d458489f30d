"""The shipped designs against the closed forms of their linkages and responses, and SciPy's optimum of those."""

import tomllib

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import least_squares, minimize, minimize_scalar

from floatframe import linearize, read_system
from floatframe.cli.fits import best_system
from floatframe.design import optimize, read_design
from floatframe.design.optimization.design import Quantity
from floatframe.design.optimization.evaluation import EvaluationFunction, response_number
from floatframe.design.studies.study_file import Output
from floatframe.errors import SystemFileError
from floatframe.machines import copy_machine
from tests.floatframe.command import run_floatframe

MU = 0.1
TRACK, RATIO, ARM = 1.4, 0.56, -0.15  #: between kingpins, over the wheelbase, arms behind the kingpins
TURNED = np.radians(40.0) * np.arange(1, 21) / 20


def right_wheel(inward, rack, half):
    """Angle of the right wheel by the rods: the rack from a root, the wheel from P cos d + Q sin d = k."""
    rod = (ARM - rack) ** 2 + (TRACK / 2 + inward - half) ** 2
    x = np.cos(TURNED) * ARM - np.sin(TURNED) * inward
    y = TRACK / 2 + np.sin(TURNED) * ARM + np.cos(TURNED) * inward
    slid = y - half - np.sqrt(rod - (x - rack) ** 2)
    end = TRACK / 2 - half + slid  # of the rack, to the left of the right kingpin
    P, Q = rack * ARM - end * inward, rack * inward + end * ARM
    k = (ARM**2 + inward**2 + rack**2 + end**2 - rod) / 2
    with np.errstate(invalid="ignore"):  # out of reach: not a number
        turn = np.arctan2(Q, P) + np.outer([1, -1], np.arccos(k / np.hypot(P, Q)))
    turn = (turn + np.pi) % (2 * np.pi) - np.pi
    return turn[np.abs(turn - 0.8 * TURNED).argmin(axis=0), np.arange(len(TURNED))]


def deviation(p):
    """sin(d_l - d_r) - ratio sin d_l sin d_r, zero where cot d_r - cot d_l is the ratio."""
    right = right_wheel(*p)
    return np.sin(TURNED - right) - RATIO * np.sin(TURNED) * np.sin(right)


def path_height(base, bar):
    """Height of the point of the coupler, 2 bar beyond the crank pin, by the meeting of two circles."""
    angle = np.pi / 2 + np.pi * np.arange(21) / 20
    pin = np.array([np.cos(angle), np.sin(angle)])
    span = np.array([[base], [0.0]]) - pin
    d = np.hypot(*span)
    e = span / d
    return pin[1] + d * e[1] + 2 * np.sqrt(bar**2 - (d / 2) ** 2) * e[0]


def swing(k, c, w):
    """Amplitude of the main mass over a force of 1 at angular frequencies w."""
    s = 1j * np.asarray(w)
    absorber = s**2 * MU + c * s + k
    return np.abs(absorber / ((s**2 + 1 + c * s + k) * absorber - (c * s + k) ** 2))


def peak(k, c, low, high):
    """Greatest swing between two frequencies in Hz, by a grid and a search in its best cell."""
    w = 2 * np.pi * np.linspace(low, high, 400)
    i = int(np.clip(swing(k, c, w).argmax(), 1, 398))
    found = minimize_scalar(
        lambda x: -swing(k, c, x), bounds=(w[i - 1], w[i + 1]), method="bounded", options={"xatol": 1e-11}
    )
    return max(-found.fun, swing(k, c, w).max())


@pytest.fixture
def copied(tmp_path):
    def copy(name):
        copy_machine(name, tmp_path / name)
        return tmp_path / name

    return copy


def test_the_deviation_of_the_steering_linkage_is_that_of_its_closed_form(copied):
    function = EvaluationFunction(read_design(copied("steering-linkage") / "ackermann.toml"))
    for p in ((-0.06, -0.09, 0.55), (-0.07, -0.08, 0.56)):
        assert_allclose(function(p).numbers[0], deviation(p), rtol=0, atol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("name", ["ackermann", "largest"])
def test_the_best_steering_linkage_is_that_of_scipy_on_its_closed_form(copied, name):
    design = read_design(copied("steering-linkage") / f"{name}.toml")
    low, high = np.array([(p.lower, p.upper) for p in design.parameters]).T
    start = [-0.06, -0.08, 0.56]
    options = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
    exact = least_squares(deviation, start, bounds=(low, high), x_scale=high - low, **options).x
    if name == "largest":
        limits = [{"type": "ineq", "fun": lambda q, s=s: 100 * (q[3] - s * deviation(q[:3]))} for s in (1, -1)]
        first = [*exact, np.abs(deviation(exact)).max()]
        bounds = [*zip(low, high, strict=True), (0, 1)]
        exact = minimize(lambda q: q[3], first, constraints=limits, bounds=bounds, options={"ftol": 1e-14}).x[:3]
    found = optimize(design)
    assert found.is_converged
    assert_allclose(list(found.values.values()), exact, rtol=0, atol=1e-6)


def test_the_path_of_the_linkage_is_that_of_its_closed_form(copied):
    function = EvaluationFunction(read_design(copied("straight-line") / "straight.toml"))
    for base, bar, height in ((2.0, 2.5, 4.0), (2.3, 2.9, 4.7)):
        assert_allclose(function((base, bar, height)).numbers[0], path_height(base, bar) - height, rtol=0, atol=1e-9)


@pytest.mark.long
def test_the_straightest_path_is_that_of_scipy_on_its_closed_form(copied):
    """Also 1 : 2.2 : 2.8, the rounded proportions of Hoecken's linkage for half a turn, is near."""
    found = optimize(read_design(copied("straight-line") / "straight.toml"))
    limits = [
        {"type": "ineq", "fun": lambda q, s=s: 100 * (q[3] - s * (path_height(q[0], q[1]) - q[2]))} for s in (1, -1)
    ]
    exact = minimize(lambda q: q[3], [2.2, 2.8, 4.6, 0.1], constraints=limits, options={"ftol": 1e-15, "maxiter": 300})
    assert found.is_converged
    assert_allclose(list(found.values.values()), exact.x[:3], rtol=0, atol=2e-5)
    assert_allclose(found.best.objective, exact.fun, rtol=1e-5)
    assert_allclose(list(found.values.values())[:2], [2.2, 2.8], rtol=0.02)


def test_the_smallest_peak_is_that_of_scipy_and_nearly_den_hartogs(copied):
    """Den Hartog: k/mu = 1/(1 + mu)², zeta² = 3 mu/(8 (1 + mu)), at the fixed points sqrt(1 + 2/mu), near the peaks."""
    folder = copied("absorber")
    found = optimize(read_design(folder / "peak.toml"), workers=1)
    k, c = found.values["k"], found.values["c"]
    sides = ((0.1, 0.15), (0.15, 0.25))
    limits = [{"type": "ineq", "fun": lambda q, s=s: q[2] - peak(q[0] / 10, q[1] / 10, *s)} for s in sides]
    exact = minimize(lambda q: q[2], [0.8, 0.4, 5.0], constraints=limits, options={"ftol": 1e-13}).x
    assert found.is_converged
    assert_allclose([k, c], exact[:2] / 10, rtol=1e-4)
    assert_allclose(found.numbers["below"], exact[2], rtol=1e-6)
    assert_allclose(found.numbers["above"], found.numbers["below"], rtol=1e-6)
    assert_allclose(k / MU, 1 / (1 + MU) ** 2, rtol=1e-3)
    assert_allclose(c / (2 * np.sqrt(k * MU)), np.sqrt(3 * MU / (8 * (1 + MU))), rtol=0.02)
    assert np.sqrt(1 + 2 / MU) < found.numbers["below"] < np.sqrt(1 + 2 / MU) * 1.002


@pytest.mark.long
def test_a_limit_on_the_damping_holds_beside_the_peak_of_the_response(copied):
    found = optimize(read_design(copied("absorber") / "both.toml"))
    assert_allclose(found.numbers["damping"], 0.14, rtol=1e-5)
    assert found.numbers["below"] > 5.5  # 4.59 without the limit
    for side, ends in (("below", (0.1, 0.15)), ("above", (0.15, 0.25))):
        assert_allclose(found.numbers[side], peak(found.values["k"], found.values["c"], *ends), rtol=1e-8)


@pytest.mark.parametrize(
    ("take", "at"), [("greatest", None), ("least", None), ("rms", None), ("mean", None), ("at", 0.2)]
)
def test_numbers_of_a_response_are_those_of_its_closed_form(copied, take, at):
    linear = linearize(read_system(copied("absorber") / "absorber.toml")[0])
    band = None if at else (0.11, 0.3)
    output = Output("x", "swing / push", "greatest" if at else take)
    found = response_number(Quantity(output, "response", band, at), linear, 1.0)
    f = np.linspace(0.11, 0.3, 400_001)
    a = swing(0.1, 0.04, 2 * np.pi * f)
    exact = {
        "greatest": a.max(), "least": a.min(), "rms": np.sqrt(np.mean(a**2)), "mean": a.mean(),
        "at": swing(0.1, 0.04, 0.4 * np.pi),
    }[take]  # fmt: skip
    assert_allclose(found, exact, rtol=1e-3 if take in ("rms", "mean") else 1e-8)


def test_the_system_with_the_best_values_is_written_with_its_comments(copied):
    folder = copied("steering-linkage")
    text = (folder / "ackermann.toml").read_text().replace("step = 1e-6", "step = 1e-6\niterations = 1")
    (folder / "ackermann.toml").write_text(text)
    found = optimize(read_design(folder / "ackermann.toml"), workers=1)
    written = best_system(found)
    best = tomllib.loads(written)
    assert "# Ackermann's condition" in written
    assert {name: best["parameters"][name] for name in found.values} == found.values


def test_best_values_in_a_base_file_are_written_into_the_file_that_results(copied):
    folder = copied("absorber")
    (folder / "heavy.toml").write_text('extends = "absorber.toml"\nbodies.main.mass = 1.1\n')
    text = (folder / "peak.toml").read_text().replace('"absorber.toml"', '"heavy.toml"\niterations = 1')
    (folder / "peak.toml").write_text(text.replace('path = "c"', 'path = "forces.tuned.damping"'))
    found = optimize(read_design(folder / "peak.toml"), workers=1)
    best = tomllib.loads(best_system(found))
    assert best["forces"]["tuned"]["stiffness"] == found.values["k"]
    assert best["forces"]["tuned"]["damping"] == found.values["c"]
    assert (best["bodies"]["main"]["mass"], "extends" in best) == (1.1, False)


def test_a_system_is_not_written_away_from_the_files_that_it_names(copied):
    folder = copied("absorber")
    refused = run_floatframe("optimize", folder / "peak.toml", "-o", folder.parent / "best.toml", code=2)
    assert "expected the folder of" in " ".join(refused.stderr.split())


@pytest.mark.parametrize(("old", "new", "words"), [
    ("band = [0.1, 0.15]", "", "expected either band or at for a frequency response, got neither"),
    ("band = [0.1, 0.15]", "band = [0.15, 0.1]", "expected two numbers, [from, to], the second greater"),
    ("band = [0.1, 0.15]", "band = [0.1, 0.15]\nat = 0.12", "got both"),
    ("band = [0.1, 0.15]", 'band = [0.1, 0.15]\ntake = "last"', "take = 'last': expected one of greatest, least"),
    ("band = [0.1, 0.15]", 'analysis = "modes"\nband = [0.1, 0.15]', 'band and at belong to analysis = "response"'),
    ('method = "slsqp"', 'method = "least-squares"', "minimises a sum of squares"),
    ('path = "c"', 'path = [{ path = "c", factor = 0 }]', "expected a number other than 0"),
])  # fmt: skip
def test_mistakes_in_responses_are_answered_in_words(copied, old, new, words):
    path = copied("absorber") / "peak.toml"
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(SystemFileError) as refused:
        read_design(path)
    assert words in " ".join(str(refused.value).split())


def test_an_unknown_output_of_a_response_is_named_with_the_nearest(copied):
    path = copied("absorber") / "peak.toml"
    path.write_text(path.read_text().replace("swing / push", "swinge / push", 1))
    evaluate = EvaluationFunction(read_design(path))
    with pytest.raises(Exception, match="no output 'swinge'; did you mean 'swing'"):
        evaluate((0.08, 0.04))

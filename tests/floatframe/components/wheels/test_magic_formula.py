"""The Magic Formula against a second writing of it, its peaks and slopes, and what surrounds it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fe_models.foundation.units import unit_system
from floatframe.components import wheels
from floatframe.components.wheels import magic_formula
from floatframe.components.wheels.coefficients import COEFFICIENTS, ONLY_52, ONLY_61, SCALES
from floatframe.components.wheels.contact import LOW_SPEED
from floatframe.components.wheels.magic_formula import SIDE, SIGN, forces_and_moments
from floatframe.components.wheels.outputs import OUTPUTS
from floatframe.errors import ModelError
from floatframe.files.signals.signal_units import unit_factor
from tests.floatframe.components.wheels.magic_formula_oracle import version_52, version_61
from tests.floatframe.components.wheels.rig import ROAD, WHEEL, answer, motion, placed, turn

HEIGHT = 0.3
rng = np.random.default_rng(7)
CASES = np.column_stack(
    [rng.uniform(1000, 8000, 40), rng.uniform(-0.6, 0.6, 40), rng.uniform(-0.5, 0.5, 40), rng.uniform(-0.2, 0.2, 40)]
)


@pytest.fixture(scope="module")
def tyres():
    return {v: wheels.read_tyre_file(wheels.shipped_tyre(f"passenger_car_{v}")) for v in (52, 61)}


def element(tyre, **changes):
    return wheels.MagicFormulaTyre("tyre", ROAD, WHEEL, tyre, **changes)


def scaled(tyre):
    """Return the tyre with factors that differ from one, so that none can be left out unseen."""
    names = [key for key in SCALES if key not in (ONLY_52 if tyre.version == 61 else ONLY_61)]
    factors = {key: 1 + 0.01 * (k + 1) * (-1) ** k for k, key in enumerate(names)}
    return replace(tyre, coefficients=dict(tyre.coefficients) | factors)


def test_the_kernel_and_the_table_of_coefficients_have_one_order():
    at = magic_formula.COEFFICIENTS_AT
    assert {name: getattr(magic_formula, name) - at for name in COEFFICIENTS} == {
        n: k for k, n in enumerate(COEFFICIENTS)
    }


@pytest.mark.parametrize("combined", [True, False])
@pytest.mark.parametrize("with_factors", [True, False])
def test_version_61_is_the_formula_of_the_textbook(tyres, combined, with_factors):
    tyre = scaled(tyres[61]) if with_factors else tyres[61]
    data = element(tyre, is_combined=combined, pressure=250e3).law(placed(HEIGHT)).data
    for Fz, kappa, alpha, gamma in CASES:
        ours = forces_and_moments(data, Fz, kappa, alpha, gamma, tyre.radius, 25.0, 1.0, 1.0, 1.0)
        theirs, _ = version_61(
            tyre.coefficients, 250e3, 220e3, Fz, kappa, alpha, gamma, 25.0, 16.7, tyre.radius, 4000.0, combined=combined
        )
        assert_allclose(ours, theirs, rtol=1e-7, atol=1e-7 * Fz)


@pytest.mark.parametrize("combined", [True, False])
@pytest.mark.parametrize("with_factors", [True, False])
def test_version_52_is_the_formula_of_the_textbook(tyres, combined, with_factors):
    tyre = scaled(tyres[52]) if with_factors else tyres[52]
    data = element(tyre, is_combined=combined).law(placed(HEIGHT)).data
    for Fz, kappa, alpha, gamma in CASES:
        ours = forces_and_moments(data, Fz, kappa, alpha, gamma, tyre.radius, 25.0, 1.0, 1.0, 1.0)
        theirs, _ = version_52(
            tyre.coefficients, Fz, kappa, alpha, gamma, 25.0, 16.7, tyre.radius, 4000.0, combined=combined
        )
        assert_allclose(ours, theirs, rtol=1e-7, atol=1e-7 * Fz)


def pure(tyre, **changes):
    """Return the tyre without shifts."""
    shifts = (
        "PHX1",
        "PHX2",
        "PVX1",
        "PVX2",
        "PHY1",
        "PHY2",
        "PHY3",
        "PVY1",
        "PVY2",
        "RHX1",
        "RHY1",
        "RHY2",
        "PEX4",
        "PEY3",
    )
    return replace(tyre, coefficients=dict(tyre.coefficients) | dict.fromkeys(shifts, 0.0) | changes)


@pytest.mark.parametrize("version", [52, 61])
def test_slopes_and_peaks_of_pure_slip_are_those_of_the_coefficients(tyres, version):
    """dF/dslip = BCD at zero; the peak D where the inner arctangent is pi/2C, which for E = 0 is tan(pi/2C)/B."""
    tyre = pure(tyres[version], PEX1=0.0, PEX2=0.0, PEX3=0.0, PEY1=0.0, PEY2=0.0)
    p, Fz = tyre.coefficients, 4000.0
    data = element(tyre, is_combined=False).law(placed(HEIGHT)).data

    def force(kappa=0.0, alpha=0.0):
        return np.array(forces_and_moments(data, Fz, kappa, alpha, 0.0, tyre.radius, 20.0, 1.0, 1.0, 1.0)[:2])

    K_x, K_y = p["PKX1"] * Fz, tyre.cornering_stiffness
    h = 1e-20j
    assert_allclose(force(kappa=h)[0].imag / 1e-20, K_x, rtol=1e-9)
    assert_allclose(force(alpha=h)[1].imag / 1e-20, K_y, rtol=1e-9)
    for k, stiffness, C, D in ((0, K_x, p["PCX1"], p["PDX1"] * Fz), (1, K_y, p["PCY1"], p["PDY1"] * Fz)):
        at = np.tan(np.pi / (2 * C)) / (stiffness / (C * D))
        slips = at * np.linspace(0.9, 1.1, 201)
        if k == 1 and version == 61:  # its slip is the tangent of the angle
            slips = np.arctan(slips)
        forces = [force(**{("kappa", "alpha")[k]: s})[k] for s in slips]
        peak = int(np.argmax(forces))
        assert_allclose(forces[100], D, rtol=1e-9)
        assert peak == 100


def test_a_sign_convention_turns_side_force_and_aligning_moment_and_nothing_else(tyres):
    """A file in adapted SAE axes (y right, z down): F_y and M_z of the same tyre have the other sign there."""
    tyre = tyres[52]
    p = dict(tyre.coefficients)
    turned = "PKY1 PVY1 PVY2 PVY3 PVY4 RVY1 RVY2 RVY3 QSX3 QDZ6 QDZ7 QDZ8 QDZ9 QBZ10 SSZ1 SSZ3 SSZ4".split()
    other = replace(tyre, coefficients=p | {key: -p[key] for key in turned})
    x = motion(HEIGHT, v=(20, -1.2, 0), omega=(0, 66, 0), A=turn(0, 0.05))
    iso = answer(element(tyre).law(placed(HEIGHT)), x, [0.02, -0.03])[0]
    sae = answer(element(other, convention="adapted-sae").law(placed(HEIGHT)), x, [0.02, -0.03])[0]
    for key in ("Fx", "Fy", "Fz", "Mx", "My", "Mz"):
        assert_allclose(sae[key], iso[key], rtol=1e-9, err_msg=key)
    assert iso["Fy"] > 1000


def test_a_file_in_the_other_signs_is_refused_by_its_cornering_stiffness(tyres):
    with pytest.raises(ModelError, match="adapted-sae"):
        element(replace(tyres[61], coefficients=dict(tyres[61].coefficients) | {"PKY1": 16.0}))
    with pytest.raises(ModelError, match="contrary to 'adapted-sae'"):
        element(tyres[61], convention="adapted-sae")


def test_the_other_side_is_the_mirror(tyres):
    law = {side: element(tyres[61], side=side).law(placed(HEIGHT)) for side in ("left", "right")}
    x = motion(HEIGHT, v=(20, 1.2, 0), omega=(0, 66, 0), A=turn(0, 0.05))
    mirrored = motion(HEIGHT, v=(20, -1.2, 0), omega=(0, 66, 0), A=turn(0, -0.05))
    left, right = answer(law["left"], x, [0.01, 0.03])[0], answer(law["right"], mirrored, [0.01, -0.03])[0]
    for key, sign in (("Fx", 1), ("Fy", -1), ("Fz", 1), ("Mx", -1), ("My", 1), ("Mz", -1)):
        assert_allclose(right[key], sign * left[key], rtol=1e-12)
    assert law["left"].data[SIDE] == 1
    assert law["right"].data[SIDE] == -1
    assert law["left"].data[SIGN] == 1


def test_inputs_beyond_the_ranges_of_the_file_are_held_there_and_counted(tyres):
    law = element(tyres[61]).law(placed(HEIGHT))
    sigma_x, sigma_y = 0.3, 0.5
    inside, _, _ = answer(law, motion(HEIGHT, v=(20, 0, 0), omega=(0, 63, 0)), [0.0, 0.0])
    assert inside["clamped"] == 0
    far, _, _ = answer(law, motion(HEIGHT, v=(20, 0, 0), omega=(0, 63, 0)), [3 * sigma_x, 30 * sigma_y])
    farther, _, _ = answer(law, motion(HEIGHT, v=(20, 0, 0), omega=(0, 63, 0)), [5 * sigma_x, 60 * sigma_y])
    assert far["clamped"] == 2
    assert_allclose([farther[k] for k in ("Fx", "Fy", "Mz")], [far[k] for k in ("Fx", "Fy", "Mz")], rtol=1e-12)
    heavy, _, _ = answer(law, motion(0.25, v=(20, 0, 0), omega=(0, 63, 0)), [0.0, 0.02])
    assert heavy["Fz"] > 9000
    assert heavy["clamped"] == 1
    leaning, _, _ = answer(law, motion(HEIGHT, v=(20, 0, 0), omega=(0, 63, 0), A=turn(0, 0.4)), [0.0, 0.0])
    assert leaning["clamped"] == 1


def test_camber_is_the_angle_between_wheel_plane_and_normal_of_the_road(tyres):
    """Camber thrust and moments without slip, of a wheel that leans by 0.25 rad towards -y."""
    tyre, lean = tyres[61], 0.25
    seen, _, _ = answer(
        element(tyre).law(placed(HEIGHT)), motion(HEIGHT, v=(25.0, 0, 0), omega=(0, 80, 0), A=turn(0, lean)), [0.0, 0.0]
    )
    assert seen["clamped"] == 0
    at = seen["Fz"], 0.0, 0.0, lean, 25.0, 16.7, tyre.radius, 4000.0
    (_, Fy, Mx, _, Mz), _ = version_61(tyre.coefficients, 220e3, 220e3, *at, combined=True)
    assert_allclose([seen[key] for key in ("Fy", "Mx", "Mz")], [Fy, Mx, Mz], rtol=1e-7)


def test_below_the_lowest_load_forces_fall_in_proportion(tyres):
    law = element(tyres[61], relaxation_x=0.3, relaxation_y=0.5).law(placed(HEIGHT))
    R = tyres[61].radius * tyres[61].coefficients["QRE0"]
    seen = [answer(law, motion(R - d, v=(1e-9, 0, 0)), [0.01, 0.02])[0] for d in (1e-5, 2e-5)]
    assert 0 < seen[1]["Fz"] < 100
    for key in ("Fx", "Fy", "Mx"):
        assert_allclose(seen[1][key] / seen[1]["Fz"], seen[0][key] / seen[0]["Fz"], rtol=1e-9)


def test_relaxation_lengths_of_the_element_stand_in_place_of_those_of_the_file(tyres):
    """u_dot = -V u/sigma_x and v_dot = -V v/sigma_y, beside what slips."""
    law, V = element(tyres[52], relaxation_x=0.3, relaxation_y=0.5).law(placed(HEIGHT)), 20.0
    rolling = motion(HEIGHT, v=(V, 0, 0), omega=(0, 66, 0))
    moving, still = (answer(law, rolling, z)[2] for z in ([1e-3, 1e-3], [0.0, 0.0]))
    assert_allclose(-V * 1e-3 / (moving - still), [0.3, 0.5], rtol=1e-9)


def test_a_wheel_that_sinks_is_held_by_the_damping_of_the_file(tyres):
    law = element(tyres[52]).law(placed(HEIGHT))
    sinking, still = (answer(law, motion(HEIGHT, v=(0, 0, w)))[0]["Fz"] for w in (-0.2, 0.0))
    assert_allclose(sinking - still, 150.0 * 0.2, rtol=1e-9)  # VERTICAL_DAMPING


def test_the_low_speed_is_that_of_the_element_or_the_file_or_one_metre_a_second(tyres):
    given = replace(tyres[52], low_speed=3.0)
    for tyre, options, low in ((given, {"low_speed": 2.5}, 2.5), (given, {}, 3.0),
                               (replace(given, low_speed=None), {}, 1.0)):  # fmt: skip
        assert element(tyre, **options).law(placed(HEIGHT)).data[LOW_SPEED] == low


def test_relaxation_lengths_come_from_the_file(tyres):
    """5.2: p_T; 6.1: slip stiffness over stiffness of the carcass. u_dot = -V u/sigma where nothing slips."""
    V = 20.0
    for version in (52, 61):
        law = element(tyres[version]).law(placed(HEIGHT))
        x = motion(HEIGHT, v=(V, 0, 0))
        seen, _, still = answer(law, x, [0.0, 0.0])
        _, _, moving = answer(law, x, [1e-3, 1e-3])
        sigma = -V * 1e-3 / (moving - still)
        p, Fz = tyres[version].coefficients, seen["Fz"]
        f, df = Fz / 4000.0, Fz / 4000.0 - 1
        if version == 52:
            x_ = Fz * (p["PTX1"] + p["PTX2"] * df) * np.exp(-p["PTX3"] * df) * 0.32 / 4000
            y_ = p["PTY1"] * np.sin(2 * np.arctan(f / p["PTY2"])) * 0.32
        else:
            _, (_, Kx, _, Ky) = version_61(p, 220e3, 220e3, Fz, 0.0, 0.0, 0.0, V, 16.7, 0.32, 4000.0)
            x_ = Kx / (3.6e5 * (1 + 0.17 * df - 0.05 * df**2))
            y_ = -Ky / (1.1e5 * (1 + 0.16 * df + 0.05 * df**2))
        assert_allclose(sigma, [x_, y_], rtol=1e-6)


def test_vertical_force_and_rolling_radius_are_those_of_the_file(tyres):
    tyre = tyres[61]
    p, R = tyre.coefficients, tyre.radius
    law = element(tyre, pressure=240e3).law(placed(HEIGHT))
    Omega, V = 60.0, 19.0
    seen, _, _ = answer(law, motion(HEIGHT, v=(V, 0, 0), omega=(0, Omega, 0)), [0.0, 0.0])
    free = R * (p["QRE0"] + p["QV1"] * (R * Omega / 16.7) ** 2)
    d, dpi = free - HEIGHT, 240 / 220 - 1
    q1 = np.sqrt((2.1e5 * R / 4000) ** 2 - 4 * p["QFZ2"])
    Fz = (1 + p["QV2"] * R / 16.7 * Omega) * (1 + p["PFZ1"] * dpi) * (q1 * d / R + p["QFZ2"] * (d / R) ** 2) * 4000
    assert_allclose(seen["Fz"], Fz, rtol=1e-9)
    stiffness = 2.1e5 * (1 + p["PFZ1"] * dpi)
    Re = free - 4000 / stiffness * (p["DREFF"] * np.arctan(p["BREFF"] * Fz / 4000) + p["FREFF"] * Fz / 4000)
    assert_allclose(seen["Vsx"], V - Re * Omega, rtol=1e-9)


def test_the_same_tyre_in_millimetres(tyres):
    """Forces in N, moments in N mm, stiffnesses in N/mm: the file is converted, pressures in MPa."""
    mm = unit_system("mm-t-s")
    si = answer(element(tyres[61]).law(placed(HEIGHT)), motion(HEIGHT, v=(20, 1, 0), omega=(0, 66, 0)), [0.01, 0.02])[0]
    in_mm = element(tyres[61], pressure=0.22).law(placed(300.0, units=mm))
    seen = answer(in_mm, motion(300.0, v=(20e3, 1e3, 0), omega=(0, 66, 0)), [10.0, 20.0])[0]
    for key, factor in (("Fx", 1), ("Fy", 1), ("Fz", 1), ("Mx", 1e3), ("My", 1e3), ("Mz", 1e3), ("energy", 1e3)):
        assert_allclose(seen[key], factor * si[key], rtol=1e-9, err_msg=key)


@pytest.mark.parametrize("name", ["mm-kg-ms", "in-slinch-s"])
@pytest.mark.parametrize("version", [52, 61])
def test_the_file_is_converted_into_units_of_the_system(tyres, version, name):
    """Sinking, leaning, near a standstill: damping and the low speed count; outputs are in the units they say."""
    units = unit_system(name)
    m, s, kg = 1 / units.length, 1 / units.time, 1 / units.mass
    lean = turn(0, 0.1)

    def seen_and_rates(m, s, units):
        own = {"settling_time": 0.02 * s} | ({"pressure": 2.4e5 * kg / m / s**2} if version == 61 and m != 1 else {})
        own |= {"pressure": 2.4e5} if version == 61 and m == 1 else {}
        law = element(tyres[version], **own).law(placed(HEIGHT * m, lean, units))
        x = motion(HEIGHT * m, v=(0.6 * m / s, 0.1 * m / s, -0.3 * m / s), omega=(0, 1.4 / s, 0.2 / s), A=lean)
        seen, _, rates = answer(law, x, [0.01 * m, 0.02 * m])
        return seen, rates, law

    si, rates_si, _ = seen_and_rates(1.0, 1.0, unit_system("m-kg-s"))
    seen, rates, law = seen_and_rates(m, s, units)
    assert si["Fz"] > 3000
    dimension = {"N": kg * m / s**2, "N m": kg * m**2 / s**2, "J": kg * m**2 / s**2, "W": kg * m**2 / s**3, "m": m,
                 "m/s": m / s, "rad": 1.0, "1": 1.0}  # fmt: skip
    for (key, unit), stated in zip(OUTPUTS.items(), law.output_units, strict=True):
        if key not in ("road_left", "off_road"):  # a flat road has no end
            assert_allclose(seen[key], dimension[unit] * si[key], rtol=1e-9, atol=1e-12, err_msg=key)
            expected = unit_factor(unit, stated) if unit not in ("rad", "1") else 1.0
            assert_allclose(dimension[unit], expected, rtol=1e-9, err_msg=key)
    assert_allclose(rates, rates_si * m / s, rtol=1e-9)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"pressure": -1.0}, "pressure: expected a number above 0"),
        ({"side": "up"}, "expected one of left, right"),
        ({"convention": "sae"}, "expected one of iso, adapted-sae"),
        ({"relaxation_x": 0.3}, "relaxation_x and relaxation_y, or neither"),
        ({"low_speed": 0.0}, "low_speed: expected a number above 0"),
    ],
)
def test_numbers_out_of_their_range_are_refused(tyres, changes, message):
    with pytest.raises(ModelError, match=message):
        element(tyres[61], **changes)


def test_a_pressure_out_of_the_range_of_the_file_is_refused(tyres):
    with pytest.raises(ModelError, match="expected 150000 to 300000 Pa"):
        element(tyres[61], pressure=4e5).law(placed(HEIGHT))
    with pytest.raises(ModelError, match="no NOMPRES"):
        element(tyres[52], pressure=2e5).law(placed(HEIGHT))


@pytest.mark.parametrize("version", [52, 61])
def test_the_grip_of_a_road_is_the_factor_of_both_frictions(tyres, version):
    """Second road: LMUX and LMUY of the file multiplied by it."""
    tyre, grip = scaled(tyres[version]), 0.55
    slippery = dict(tyre.coefficients) | {key: grip * tyre.coefficients[key] for key in ("LMUX", "LMUY")}
    one, other = (element(each).law(placed(HEIGHT)).data for each in (tyre, replace(tyre, coefficients=slippery)))
    for case in CASES[:5]:
        ours = forces_and_moments(one, *case, tyre.radius, 25.0, 1.0, 1.0, grip)
        assert_allclose(ours, forces_and_moments(other, *case, tyre.radius, 25.0, 1.0, 1.0, 1.0), rtol=1e-12)
    wet = element(tyre, road=wheels.FlatRoad(wheels.Grip([-1, 1], [grip, grip]))).law(placed(HEIGHT))
    x = motion(height=0.3, v=(20, 2, 0), omega=(0, 55, 0))
    dry = element(replace(tyre, coefficients=slippery)).law(placed(HEIGHT))
    z = [2e-3, 1e-3]
    assert_allclose(answer(wet, x, z)[1], answer(dry, x, z)[1], rtol=1e-12)

"""The beam problems of Bauchau and others, by bodies in parts, against rods solved by shooting and exact beams."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from benchmarks.field_beams import UNITS, exact, marker_of, parts, path, segments, superelements
from floatframe import GeneralizedAlpha, integrate, static_equilibrium
from floatframe.analyses import equilibrium, snapshot
from floatframe.components.flexible_parts import floating_parts
from floatframe.components.mechanisms import buckling_beam, loaded_cantilever, misaligned_four_bar, unbalanced_shaft
from floatframe.components.mechanisms.beam_benchmarks import (
    FOUR_BAR_LINES,
    PRINCETON_LINE,
    SHAFT_LINE,
    crank_turn,
    shaft_turn,
)
from floatframe.errors import ModelError
from floatframe.model.functions.time_functions import polynomial_of_time
from tests.references.cosserat_rod import cantilever, four_bar

LENGTH = PRINCETON_LINE.length


def end_of(describe, load, angle):
    system = loaded_cantilever(describe, load=load, angle=np.deg2rad(angle))
    state = static_equilibrium(system).state
    return path(snapshot(system, state), system, marker_of(describe, PRINCETON_LINE, "beam", "end"))[0]


@cache
def true_end(load, angle):
    b = np.deg2rad(angle)
    return cantilever(PRINCETON_LINE, load * np.array([0, -np.cos(b), np.sin(b)])).r


def error_of(describe, load, angle):
    true = true_end(load, angle)
    return np.linalg.norm(end_of(describe, load, angle) - true) / np.linalg.norm(true - [LENGTH, 0, 0])


def test_rods_by_shooting_end_where_the_elastica_does():
    # Bisshopp and Drucker's cantilever at P L²/EI = 1: 0.30172 L aside, 0.05643 L back (no shear, no tension)
    line = replace(PRINCETON_LINE, EA=1e12, GAy=np.inf, GAz=np.inf, EIz=1e9)
    force = line.EIy / LENGTH**2 * np.array([0, 0, 1.0])
    end = cantilever(line, force).r / LENGTH
    np.testing.assert_allclose([1 - end[0], end[2]], [0.05643, 0.30172], rtol=0, atol=1e-5)


def test_segments_find_the_oblique_equilibrium_to_second_order():
    errors = [error_of(segments(n), 13.345, 45) for n in (5, 9)]
    assert errors[0] < 1e-2
    assert 0.2 < errors[1] / errors[0] < 0.35


@pytest.mark.parametrize(("describe", "most"), [(segments(5), 1e-2), (segments(65), 1e-4), (superelements(32), 2e-4)])
def test_long_rows_find_the_oblique_equilibrium_at_once_within_a_hundred_solves(describe, most, monkeypatch):
    made, solve = [], equilibrium.solve

    def counted(*args):
        made.append(1)
        return solve(*args)

    monkeypatch.setattr(equilibrium, "solve", counted)
    assert error_of(describe, 13.345, 45) < most
    assert len(made) <= 100


def test_the_princeton_beam_in_two_parts_is_exact_to_a_thousandth_where_a_part_may_twist_along_its_length():
    assert 4e-3 < error_of(parts(1), 13.345, 45) < 7e-3
    assert error_of(parts(2), 13.345, 45) < 1e-3
    # one function of torsion is not enough: the moment that twists is not linear along a part
    errors = [error_of(parts(n, n_torsion=1), 13.345, 45) for n in (2, 4)]
    assert errors[0] > 5e-3
    assert 0.2 < errors[1] / errors[0] < 0.31


def test_in_a_principal_plane_four_parts_are_exact_to_a_ten_thousandth():
    assert error_of(parts(4), 13.345, 90) < 1e-4
    assert error_of(segments(17), 13.345, 90) < 1e-3
    assert error_of(superelements(8), 13.345, 90) < 3e-3


def test_a_beam_that_is_not_stiffened_stays_too_stiff_along_its_stiff_axis():
    # it does not know how the load twists it, nor that the twist lets it bend further along its stiff axis
    linear, stiffened = (end_of(parts(1, stiffening=on), 13.345, 45)[1] for on in (False, True))
    true = true_end(13.345, 45)[1]
    assert abs(linear - true) > 20 * abs(stiffened - true) > 0


def test_elastic_bars_turn_where_rigid_ones_are_locked():
    angle = np.deg2rad(40.0)
    turn = polynomial_of_time([0.0, 0.0, -angle / 2, angle / 4])  # rests at both ends of (0, 4/3)
    describe = parts(1)
    system = misaligned_four_bar(describe, turn=turn)
    motion = integrate(system, GeneralizedAlpha(0.3), 1.2, 4e-3, output_every=300)
    C = path(motion, system, marker_of(describe, FOUR_BAR_LINES[1], "bar 2", "end"))[-1]
    at_rest = four_bar(FOUR_BAR_LINES, turn(1.2), np.zeros(8)).C
    assert at_rest[2] < -5e-4
    np.testing.assert_allclose(C, at_rest, rtol=0, atol=3e-6)


def test_a_shaft_in_two_parts_bends_as_the_exact_beam_through_its_critical_speed():
    found = {}
    for name, describe in (("exact", exact(16)), ("parts", parts(2))):
        system = unbalanced_shaft(describe, turn=shaft_turn())
        start = static_equilibrium(system).state
        motion = integrate(system, GeneralizedAlpha(0.6), 1.1, 2e-3, output_every=5, state=start)
        found[name] = path(motion, system, marker_of(describe, SHAFT_LINE, "shaft", "middle"))[:, 1:]
    largest = np.linalg.norm(found["exact"], axis=1).max()
    assert largest > 0.1
    assert np.linalg.norm(found["exact"] - found["parts"], axis=1).max() < 0.02 * largest


def test_the_disk_of_the_shaft_is_a_solid_cylinder():
    """m r²/2 about its axis and m (3 r² + h²)/12 across it; its centre is 50 mm above the middle of the shaft."""
    system = unbalanced_shaft(exact(2), turn=shaft_turn())
    disk = next(body for body in system.bodies if body.name == "disk")
    m, r, h = disk.mass, 0.24, 0.05
    assert_allclose(m, 7800 * np.pi * r**2 * h, rtol=1e-4, atol=0)
    across = m * (3 * r**2 + h**2) / 12
    assert_allclose(disk.inertia, np.diag([m * r**2 / 2, across, across]), rtol=1e-12, atol=0)
    assert_allclose(disk.position, [SHAFT_LINE.length / 2, 0, 0.05], rtol=1e-12, atol=0)


def test_a_thin_beam_buckles_sideways():
    describe = segments(9)
    system = buckling_beam(describe, turn=crank_turn())
    motion = integrate(system, GeneralizedAlpha(0.6), 0.18, 1e-3, output_every=10)
    side = np.abs(path(motion, system, marker_of(describe, PRINCETON_LINE, "beam", "middle"))[:, 1])
    assert side[motion.t < 0.1].max() < 2e-3
    assert side[-1] > 0.02


def test_turns_are_those_of_the_problems():
    turn, t = shaft_turn(60.0), np.linspace(0, 2, 2001)
    rate = np.array([turn(x, 1) for x in t])
    np.testing.assert_allclose(rate[[0, 250, 500, 1000, 1125, 1250, 2000]], [0, 24, 48, 48, 60, 72, 72], atol=1e-9)
    np.testing.assert_allclose(turn(2.0), np.trapezoid(rate, t), rtol=1e-6)
    crank = crank_turn(0.4)
    np.testing.assert_allclose(
        [crank(0.0), crank(0.2), crank(0.4), crank(1.0)], [0, -np.pi / 2, -np.pi, -np.pi], atol=1e-12
    )


def test_parts_without_bodies_or_geometric_stiffness_are_refused():
    with pytest.raises(ModelError, match="floating_parts 'beam': expected a reduced body or several, got none"):
        floating_parts("beam", [])
    plain = cms.reduction.beam_from_assumed_modes(SHAFT_LINE, name="plain", units=UNITS, geometric=False)
    with pytest.raises(ModelError, match="body 'plain' has no geometric stiffness; reduce it with geometric=True"):
        floating_parts("beam", [plain])

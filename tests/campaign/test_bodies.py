"""The campaign of bodies: its oracle finds what is wrong in a reduced body, and a seed gives the same body again."""

from dataclasses import replace

import numpy as np
import pytest

import cms
from tests.campaign.bodies import MOST, body_verdict, defects, reduced_of
from tests.campaign.random_bodies import random_body
from tests.campaign.verdict import ACCEPTED

SEED = 18  #: tetrahedra, a rigid and a distributing interface, a nodal frame


@pytest.fixture(scope="module")
def case():
    return replace(random_body(SEED), damping=cms.reduction.RayleighDamping(0.1, 0.1))


@pytest.fixture(scope="module")
def made(case):
    reduced, coupled, columns = reduced_of(case)
    assert max(defects(case, coupled, columns, reduced).values()) < MOST
    return reduced, coupled, columns


def turned(port):
    """The interface with its motion turned about an axis by a thousandth."""
    return replace(port, Psi=port.Psi + 1e-3 * np.roll(port.Psi, 1, axis=0))


WRONG = {
    "M": lambda b: replace(b, M=1.001 * b.M),
    "K": lambda b: replace(b, K=b.K * np.linspace(1, 1.001, b.n_q)),
    "D": lambda b: replace(b, D=0 * b.D),
    "Phi": lambda b: replace(b, Phi=b.Phi * (1 + 1e-3 * np.sin(np.arange(b.Phi.size)).reshape(b.Phi.shape))),
    "frequencies": lambda b: replace(b, free_frequencies=1.0001 * b.free_frequencies),
    "mass": lambda b: replace(b, moments=replace(b.moments, m=1.001 * b.moments.m)),
    "inertia": lambda b: replace(b, moments=replace(b.moments, R=b.moments.R + 1e-3 * np.diag(np.diag(b.moments.R)))),
    "1C": lambda b: replace(b, moments=replace(b.moments, C1=b.moments.C1 + 1e-3 * np.abs(b.moments.C1).max())),
    "2C": lambda b: replace(b, moments=replace(b.moments, P=b.moments.P * np.array([1, 1, 1.01])[:, None, None])),
    "Psi right": lambda b: replace(b, interfaces=(b.interfaces[0], turned(b.interfaces[1]))),
    "places": lambda b: replace(b, nodes=b.nodes + 1e-3 * np.ptp(b.nodes)),
    "force": lambda b: replace(b, load_cases=(replace(b.load_cases[0], force=1.01 * b.load_cases[0].force),)),
    "torque": lambda b: replace(b, load_cases=(replace(b.load_cases[0], torque=-b.load_cases[0].torque),)),
    "h": lambda b: replace(b, load_cases=(replace(b.load_cases[0], h=b.load_cases[0].h[::-1]),)),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_in_a_reduced_body_is_found_by_its_name(case, made, name):
    reduced, coupled, columns = made
    assert defects(case, coupled, columns, WRONG[name](reduced))[name] > MOST


def test_the_span_of_another_set_is_found(case, made):
    reduced, coupled, columns = made
    other = replace(case, set_name="normal", n_modes=4)
    assert defects(other, coupled, columns, reduced)["span"] > 0.01


def test_a_frame_that_moves_is_found(case, made):
    reduced, coupled, columns = made
    for frame in (cms.TisserandFrame(), cms.NodalFrame("right")):
        assert defects(replace(case, frame=frame), coupled, columns, reduced)["frame"] > MOST


@pytest.mark.parametrize("seed", [250543, 250628], ids=["nodal frame", "craig-chang"])
def test_the_oracle_does_not_amplify_rounding_of_bent_beams(seed):
    """Translations of all nodes tell 24 fields apart to 3e-6 of their size, and rounding became errors of 2e-4."""
    case = random_body(seed)
    reduced, coupled, columns = reduced_of(case)
    assert max(defects(case, coupled, columns, reduced).values()) < 1e-8


def test_rounding_of_members_nearly_on_a_line_is_no_fault():
    """Four members 0.0014 of the body's size off a line: their mean rotation is 700 times as wrong as their motions."""
    case = random_body(280385)
    reduced, coupled, columns = reduced_of(case)
    found = defects(case, coupled, columns, reduced)
    assert max(found.values()) < MOST
    assert found["Psi right"] < 3 * found["span"]


def test_wrong_rotations_of_the_nodes_of_beams_are_found():
    case = random_body(250543)
    reduced, coupled, columns = reduced_of(case)
    kept = replace(reduced.kept, rotation=reduced.kept.rotation * np.linspace(1, 1.001, reduced.n_q))
    assert defects(case, coupled, columns, replace(reduced, kept=kept))["Phi"] > MOST


def test_a_sound_body_that_is_refused_is_a_fault(case, tmp_path):
    verdict = body_verdict(replace(case, frame=cms.NodalFrame("nowhere")), tmp_path)
    assert verdict.kind != ACCEPTED
    assert "nowhere" in verdict.words


def test_a_seed_gives_the_same_random_body_again():
    one, again = random_body(SEED), random_body(SEED)
    assert one.words == again.words
    np.testing.assert_array_equal(one.body.nodes, again.body.nodes)
    assert random_body(SEED + 1).words != one.words

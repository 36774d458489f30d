"""Bodies whose inertia is not wholly known: refused, or moved without what is missing, exact to a stated order."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from cms.body.invariants import INERTIA_TERMS
from cms.body.linear_range import LEFT_OUT
from floatframe import GeneralizedAlpha, integrate
from floatframe.errors import ModelError, SystemFileError
from floatframe.files.system_file.read_system import read_system
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.system import System
from floatframe.results.validity import notes_from_json, notes_to_json
from tests.floatframe.orders import slope
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

N_Q = 4
OMEGA = 6.0


def body_of(missing=INERTIA_TERMS):
    whole = reduced_body(random_point_masses(N_Q, 3), stiffness(N_Q, omega=OMEGA))
    return replace(whole, moments=replace(whole.moments, missing=missing))


def moving(missing, amplitude):
    reduced = body_of(missing)
    q = amplitude * np.array([0.3, -0.2, 0.1, 0.25])
    spin = amplitude * np.array([1.5, -2.0, 1.0])
    return System([FlexibleBody("body", reduced, omega_B=spin, q=q, leave_out_missing=bool(missing))])


def test_a_motion_that_needs_missing_terms_is_refused_with_the_remedy():
    with pytest.raises(ModelError, match=r"needs the inertia terms 3C, 4C, 5C.*cms import.*leave_out_missing = true"):
        FlexibleBody("body", body_of())
    with pytest.raises(ModelError, match="expected true or false, got 'yes'"):
        FlexibleBody("body", body_of(), leave_out_missing="yes")
    FlexibleBody("body", body_of(()))


def test_without_missing_terms_the_motion_is_exact_to_first_order():
    amplitudes = np.array([4e-2, 2e-2, 1e-2, 5e-3])
    errors = []
    for amplitude in amplitudes:
        q, angle = [], []
        for missing in ((), INERTIA_TERMS):
            motion = integrate(moving(missing, amplitude), GeneralizedAlpha(0.9, 1e-12), 1.0, 5e-3)
            q.append(motion.body("body").q[-1])
            angle.append(motion.body("body").p[-1])
        errors.append(max(np.abs(q[1] - q[0]).max(), np.abs(angle[1] - angle[0]).max()))
    assert_allclose(slope(amplitudes, errors), 2, rtol=0, atol=0.15)


@pytest.mark.parametrize("missing", [INERTIA_TERMS, ("5C",), ("3C", "5C")])
def test_what_is_left_out_is_left_out_of_energy_and_momentum_too(missing):
    steps = np.array([8e-3, 4e-3, 2e-3])
    motions = [integrate(moving(missing, 1.0), GeneralizedAlpha(0.9, 1e-11), 1.0, h, output_every=5) for h in steps]
    for of in (lambda m: m.energies.total[:, None], lambda m: m.linear_momentum, lambda m: m.angular_momentum):
        scale = np.abs(of(motions[0])).max() + 1.0
        errors = [np.abs(of(m) - of(m)[0]).max() / scale for m in motions]
        assert errors[-1] < 1e-10 or abs(slope(steps, errors) - 2) < 0.3, errors


def test_a_motion_that_turns_fast_is_told_what_it_cannot_know():
    motion = integrate(moving(INERTIA_TERMS, 1.0), GeneralizedAlpha(0.9), 0.1, 5e-3)
    note = next(note for note in motion.validity if note.kind == "inertia")
    assert note.limit == LEFT_OUT
    assert note.largest > LEFT_OUT
    assert "inertia terms are omitted" in note.words
    assert "full mass matrix" in note.words
    assert notes_from_json(notes_to_json([note])) == (note,)
    slow = integrate(moving(INERTIA_TERMS, 0.01), GeneralizedAlpha(0.9), 0.1, 5e-3)
    assert not slow.validity
    assert not any(n.kind == "inertia" for n in integrate(moving((), 1.0), GeneralizedAlpha(0.9), 0.1, 5e-3).validity)


def test_the_key_of_a_system_file(tmp_path):
    cms.write(body_of(), tmp_path / "part.h5")

    def read(body, *lines):
        text = f'[system]\nunits = "m-kg-s"\n[bodies.part]\n{body}\n' + "\n".join(lines)
        text += "\n[run]\nt_end = 1.0\nh = 1e-2\n"
        (tmp_path / "system.toml").write_text(text)
        return read_system(tmp_path / "system.toml")[0].bodies[0]

    assert read('file = "part.h5"', "leave_out_missing = true").leave_out_missing
    with pytest.raises(SystemFileError, match="needs the inertia terms"):
        read('file = "part.h5"')
    rigid = "mass = 1.0\ninertia = [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]]"
    with pytest.raises(SystemFileError, match="leave_out_missing: a rigid body has all of its inertia"):
        read(rigid, "leave_out_missing = true")

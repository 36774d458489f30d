"""Every element in other units: the same forces, rates and outputs, in the units that it says."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fe_models.foundation.units import unit_system
from floatframe.files.signals.signal_units import unit_factor
from floatframe.model.elements import Placed
from tests.floatframe.element_laws import evaluate
from tests.floatframe.laws import contacts, drives, hydraulics, others
from tests.floatframe.laws.form import plain
from tests.floatframe.other_units import Other

FORMS = drives.FORMS | hydraulics.FORMS | contacts.FORMS | others.FORMS
FORMS.pop("expressions")  # its numbers stand in texts, without units
ELECTRICAL = ("A", "V", "V s")  #: such that volt times ampere is the unit of power: their names stay
UNLIMITED = ("road_left", "off_road")


def in_words(unit):
    """Return a unit of a law in the words of the table of units."""
    return {"": "1", "m^3/s": "m^3/s", "rad/s": "rad/s"}.get(unit, unit)


def motion_in(x, other):
    """Return the motion of markers in other units."""
    y = np.array(x)
    y[:, :3] *= other.factor("m")
    y[:, 12:15] *= other.factor("m/s")
    y[:, 15:18] *= other.factor("1/s")
    return y


@pytest.mark.parametrize("name", ["mm-kg-ms", "in-slinch-s"])
@pytest.mark.parametrize("form", FORMS)
def test_an_element_acts_alike_in_other_units(form, name):
    form, other = FORMS[form], Other(unit_system(name))
    law = form.law()
    r, A = form.placed[:, :3] * other.factor("m"), form.placed[:, 3:12].reshape(-1, 3, 3)
    twin = other.part(form.element).law(Placed(r, A, (False,) * len(r), other.units))
    of_states = np.array([other.factor(in_words(unit)) for unit in law.state_units])
    assert_allclose(twin.start, law.start * of_states, rtol=1e-9)
    function = plain(law.rest if form.is_rest else law.function)
    for unit, stated in zip(law.output_units, twin.output_units, strict=True):
        if unit not in (*ELECTRICAL, "1", "", "rad"):
            assert_allclose(unit_factor(unit, stated), other.factor(in_words(unit)), rtol=1e-9)
    for state in form.all_states:
        z = np.array([state.z[key] for key in law.states])
        wrench, rates, seen = evaluate(law, state.t, state.x, z, function)
        found = evaluate(twin, state.t * other.factor("s"), motion_in(state.x, other), z * of_states, function)
        for part, unit in ((slice(0, 3), "N"), (slice(3, 6), "N m")):
            wanted = wrench[:, part] * other.factor(unit)
            assert_allclose(found[0][:, part], wanted, rtol=0, atol=1e-9 * (np.abs(wanted).max() or 1.0))
        per_time = of_states / other.factor("s")
        off = np.abs(found[1] / per_time - rates)
        if form.is_rest:  # what vanishes at rest is no rate: its time is the unit, and its zero alone counts
            off = np.minimum(off, np.abs(found[1] / of_states - rates))
        assert (off <= 1e-9 * (np.abs(rates) + np.abs(z))).all(), dict(zip(law.states, off, strict=True))
        for key, unit in zip(law.outputs, law.output_units, strict=True):
            if key not in UNLIMITED:
                wanted = seen[key] * other.factor(in_words(unit))
                assert_allclose(found[2][key], wanted, rtol=1e-7, atol=1e-11 * abs(other.factor(in_words(unit))),
                                err_msg=key)  # fmt: skip

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fe_models.foundation.units import UNIT_SYSTEMS
from floatframe.errors import SignalError
from floatframe.files.signals import Signal
from floatframe.files.signals.signal_units import parsed_unit, per_hertz, system_factor, unit_factor
from floatframe.results.sensors.measurement import unit_words


@pytest.mark.parametrize(
    ("unit", "wanted", "factor"),
    [
        ("g", "m/s^2", 9.80665), ("mm/s²", "m/s2", 1e-3), ("g^2/Hz", "(m/s^2)^2/Hz", 9.80665**2),
        ("kNm", "N m", 1e3), ("N/mm²", "MPa", 1.0), ("rpm", "rad/s", 0.10471975511965977), ("km/h", "m/s", 1 / 3.6),
        ("deg", "rad", 0.017453292519943295), ("lbf", "N", 4.4482216152605), ("in/s/s", "g", 0.0254 / 9.80665),
        ("m s^-2", "mm/ms**2", 1e-3), ("%", "-", 0.01), ("[kN]", "N", 1e3), ("µm", "um", 1.0), ("1/min", "Hz", 1 / 60),
    ],
)  # fmt: skip
def test_units_convert(unit, wanted, factor):
    assert_allclose(unit_factor(unit, wanted), factor, rtol=1e-14, atol=0)


def test_a_signal_in_another_unit_is_the_same_quantity():
    signal = Signal("v", np.arange(3.0), np.array([1.0, -20.0, 500.0]), "mm/s").to("km/h")
    assert signal.unit == "km/h"
    assert_allclose(signal.values, [0.0036, -0.072, 1.8], rtol=1e-14, atol=0)


@pytest.mark.parametrize(
    "text", ["foo", "m/", "m^99", "counts", "mg", "(m", "m)", "2 kN", "m" * 60, "^", "1e5", "g mm/s"]
)
def test_words_that_are_no_unit_are_not_understood(text):
    assert parsed_unit(text) is None
    with pytest.raises(SignalError, match="is not understood"):
        unit_factor(text, "m")


def test_units_of_different_quantities_are_not_converted():
    with pytest.raises(SignalError, match=r"g \(acceleration\) cannot be converted to m \(length\)"):
        unit_factor("g", "m")


@pytest.mark.parametrize("units", UNIT_SYSTEMS.values(), ids=UNIT_SYSTEMS)
@pytest.mark.parametrize(
    "what", ["length", "speed", "acceleration", "force", "moment", "stress", "momentum", "angular momentum"]
)
def test_words_of_a_unit_system_are_one_of_its_units(units, what):
    """The units that sensors state are what the system says: the factor to it is one; grams are asked back."""
    if units.mass_symbol == "g" and "momentum" in what:
        with pytest.raises(SignalError, match="is not understood"):
            system_factor(unit_words(units, what), units)
        return
    assert_allclose(system_factor(unit_words(units, what), units), 1.0, rtol=1e-9, atol=0)


def test_an_acceleration_in_g_in_millimetres_and_milliseconds():
    assert_allclose(system_factor("g", UNIT_SYSTEMS["mm-kg-ms"]), 9.80665e-3, rtol=1e-14, atol=0)


def test_units_of_densities():
    assert [per_hertz(unit) for unit in ("m/s²", "mm", "", "N m")] == ["(m/s²)²/Hz", "mm²/Hz", "1/Hz", "(N m)²/Hz"]

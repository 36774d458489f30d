"""Public classes and functions name an argument of the wrong kind; nothing fails inside."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, is_dataclass
from types import MappingProxyType
from typing import Annotated, Literal

import numpy as np
import pytest
from numpy.typing import ArrayLike

import cms
import fe_models
import floatframe as ff
from fe_models.foundation.errors import ReportedError
from fe_models.foundation.records import MismatchError, Takes, checked_fields, conformed
from fe_models.foundation.units import Units
from tests.bodies import bar
from tests.public_objects import public_objects


class Stranger:
    """Of no kind that anything expects."""


def required(subject):
    """Return the parameters without a default."""
    kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    parameters = inspect.signature(subject).parameters.values()
    return [each.name for each in parameters if each.default is each.empty and each.kind in kinds]


def is_made_or_called(subject):
    if inspect.isclass(subject):
        return not issubclass(subject, Exception) and not getattr(subject, "_is_protocol", False)
    return callable(subject)


PUBLIC = [
    pytest.param(each, id=name)
    for package in ("fe_models", "cms", "floatframe")
    for name, each in public_objects(package).items()
    if is_made_or_called(each) and required(each)
]


@pytest.mark.parametrize("subject", PUBLIC)
def test_an_argument_of_another_kind_is_refused_in_words(subject):
    given = {name: Stranger() for name in required(subject)}
    with pytest.raises(ReportedError):
        subject(**given)


@pytest.mark.parametrize("subject", PUBLIC)
def test_an_argument_that_is_unknown_is_told(subject):
    is_checked = inspect.isroutine(subject) or is_dataclass(subject)
    with pytest.raises(TypeError, match="no argument 'nosuch'" if is_checked else "nosuch"):
        subject(nosuch=1)


def test_a_misspelt_field_is_answered_with_the_nearest_as_in_a_file():
    with pytest.raises(TypeError, match=r"RevoluteJoint: no argument 'axes'; did you mean 'axis'\?"):
        ff.RevoluteJoint("pin", "ground", "rod", axes=(0, 0, 1))


def test_arguments_have_one_order():
    """System before motion before body; a file after the object that is written to it."""
    order = ("system", "trajectory", "motion", "body", "path")
    for each in (param.values[0] for param in PUBLIC if inspect.isroutine(param.values[0])):
        names = [name for name in required(each) if name in order]
        assert names == sorted(names, key=order.index), f"{each.__module__}.{each.__name__}: {names}"
        assert "system" not in names or required(each)[0] == "system", f"{each.__module__}.{each.__name__}"


def block(**changes):
    return ff.RigidBody(**{"name": "block", "mass": 2.0, "inertia": np.diag([1.0, 2, 2.5])} | changes)


def test_a_body_alone_stands_for_a_list_and_a_name_for_units():
    system = ff.System(block(), units="mm-t-s")
    assert [body.name for body in system.bodies] == ["block"]
    assert system.units.name == "mm-t-s"
    with pytest.raises(fe_models.errors.UnitsError, match="unknown unit system 'si'"):
        ff.System(block(), units="si")


def test_a_marker_can_be_written_as_body_and_interface():
    spring = ff.SpringDamper("spring", "ground", "rod.big_end", stiffness=10.0)
    assert (spring.marker_a.body, spring.marker_a.interface) == ("ground", None)
    assert (spring.marker_b.body, spring.marker_b.interface) == ("rod", "big_end")
    pin = ff.RevoluteJoint("pin", "rod.big_end", "rod.2")
    (pin,) = ff.System(block(name="rod.2"), pin).joints
    assert (pin.marker_a.body, pin.marker_a.interface, pin.marker_b) == ("rod", "big_end", "rod.2")


@pytest.mark.parametrize("integrator", [ff.GeneralizedAlpha, "generalized-alpha", ff.GeneralizedAlpha()])
def test_an_integrator_is_an_object_a_class_or_a_name(integrator):
    system = ff.System(block(velocity=(1.0, 2.0, 3.0), omega_B=(3.0, -1.0, 2.0)))
    motion = ff.integrate(system, integrator, 0.1, 0.01)
    expected = ff.integrate(system, ff.GeneralizedAlpha(), 0.1, 0.01)
    np.testing.assert_array_equal(motion.body("block").r, expected.body("block").r)


WRONG = {
    "an end before the step": (lambda s: ff.integrate(s, "hht", 0.01, 1.0), "h: .*swapped"),
    "a scheme that is none": (lambda s: ff.integrate(s, "htt", 1.0, 0.01), "did you mean 'hht'"),
    "a class with a parameter": (lambda s: ff.integrate(s, ff.RigidBody, 1.0, 0.01), "integrator"),
    "a time as text": (lambda s: ff.integrate(s, "hht", "1 s", 0.01), "t_end: expected a number, got '1 s'"),
    "a list as a system": (lambda s: ff.integrate([s], "hht", 1.0, 0.01), "system: expected a System"),
    "a class for an object": (lambda s: ff.System([ff.RigidBody]), "bodies: .* each of it a RigidBody or a Flex"),
    "three moments": (lambda s: block(inertia=(1.0, 2.0, 2.5)), r"numpy.diag\(\[1.0, 2.0, 2.5\]\)"),
    "a ragged tensor": (lambda s: block(inertia=[[1.0], [2.0, 2.5], [3.0]]), "inertia: expected numbers of shape"),
    "a joint of numbers": (lambda s: ff.RevoluteJoint("pin", 1, 2, axis=(0, 0, 1)), "'pin': marker_a: expected a Mark"),
    "a mode set that is none": (lambda s: cms.reduce(cms.couple(bar()), 12), "modes: expected a ModeSet, got 12"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_was_meant_is_said(name):
    call, words = WRONG[name]
    with pytest.raises(ReportedError, match=words):
        call(ff.System([block()]))


@pytest.mark.parametrize(
    ("hint", "value", "found"),
    [
        (Sequence[str], "x", ("x",)),
        (Sequence[float] | None, None, None),
        (float | None, 2, 2),
        (type, float, float),
        (tuple[str, ...], ["x", "y"], ("x", "y")),
        (tuple[str, float], ["x", 2.0], ["x", 2.0]),
        (ArrayLike, [1, 2.0], [1, 2.0]),
        (Callable[[float], float], abs, abs),
        (Literal["a", "b"], "b", "b"),
        (Mapping[str, int], {"a": 1}, {"a": 1}),
        (dict[str, int], MappingProxyType({"a": 1}), {"a": 1}),
        (Sequence[Units], ["mm-t-s"], (fe_models.UNIT_SYSTEMS["mm-t-s"],)),
    ],
)
def test_values_become_what_the_annotation_wants(hint, value, found):
    assert conformed(hint, value) == found


@pytest.mark.parametrize(
    ("hint", "value", "words", "wrong"),
    [
        (Sequence[str], ["a", 3], "a list, each of it text", 3),
        (tuple[str, ...], 3, "a list, each of it text", 3),
        (float, "2", "a number", "2"),
        (str | None, 3, "text", 3),
        (ArrayLike | None, "x", "numbers", "x"),
        (Callable[[float], float], 3, "a function", 3),
        (Mapping[str, int], [3], "a dictionary", [3]),
        (Literal["a", "b"], "c", "one of a, b", "c"),
        (Literal["a", "b"], ["c", "d"], "one of a, b", ["c", "d"]),
        (Units, 3, "a Units", 3),
        (
            int | Units | str | Mapping[str, int] | bool,
            [3],
            "a number or a Units or text or one of 2 other kinds",
            [3],
        ),
        (int | Units | str | Mapping[str, int] | None, [3], "a number or a Units or text or a dictionary", [3]),
    ],
)
def test_another_kind_is_told(hint, value, words, wrong):
    with pytest.raises(MismatchError) as caught:
        conformed(hint, value)
    assert caught.value.args == (words, wrong)


@dataclass
@checked_fields(ff.errors.ModelError)
class Inputs:
    """Annotations that look at a class, and those that look at contents."""

    number: float | None = None
    names: Sequence[str] = ()
    choice: Literal["a", "b"] | float = "a"
    level: Annotated[float, Takes(Literal[1, 2])] = 1
    units: Units | str | None = None


def test_inputs_of_a_class_that_was_taken_are_judged_by_their_contents_where_those_count():
    Inputs(2.0, ["a"], "a", 1, "mm-t-s")
    for name, value in {"names": ["a", 3], "choice": "c", "level": 3, "number": "2"}.items():
        with pytest.raises(ff.errors.ModelError, match=f"{name}: expected "):
            Inputs(**{name: value})
    assert Inputs(names="b").names == ("b",)
    with pytest.raises(ReportedError, match="unknown unit system"):
        Inputs(units="mm-t-h")

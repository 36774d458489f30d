"""Public objects show themselves in a few lines, as text and in notebooks."""

import dataclasses
import inspect
import typing
from html.parser import HTMLParser

import numpy as np
import pytest
import scipy.sparse as sp

import cms
import floatframe as ff
from fe_models.foundation.documents.table import Table
from fe_models.foundation.presentation import LONGEST_VALUE, MOST_ROWS, Summary, presented, text_of
from tests.bodies import bar
from tests.public_objects import public_objects
from tests.synthetic import synthetic_reduced_body

LONGEST, MOST_LINES = 2000, 30
PUBLIC = {
    each: name
    for package in ("fe_models", "cms", "floatframe")
    for name, each in public_objects(package).items()
    if inspect.isclass(each) and dataclasses.is_dataclass(each)
}


@pytest.fixture(scope="module")
def objects():
    """Return objects of a chain from an FE body to a motion."""
    body = cms.couple(bar())
    modes = cms.craig_bampton(body, 6)
    reduced = cms.reduce(body, modes)
    large = synthetic_reduced_body(n_q=40, n_nodes=400, units="m-kg-s")
    bodies = [ff.FlexibleBody(f"rod{k}", reduced if k else large) for k in range(30)]
    joints = [
        ff.SphericalJoint(
            f"ball{k}", ff.Marker("ground"), ff.Marker(f"rod{k}", large.interfaces[0].name if k == 0 else "left")
        )
        for k in range(30)
    ]
    crowd = ff.System(bodies, joints, [ff.Gravity((0, 0, -9.81))], name="crowd")
    rod = ff.RigidBody("rod", 2.0, np.diag([0.01, 0.2, 0.2]), center_of_mass=np.array([0.5, 0, 0]))
    pin = ff.RevoluteJoint("pin", ff.Marker("ground"), ff.Marker("rod"), axis=np.array([0, 1.0, 0]))
    pendulum = ff.System([rod], [pin], [ff.Gravity((0, 0, -9.81))], name="pendulum")
    motion = ff.integrate(pendulum, ff.GeneralizedAlpha(), 0.02, 1e-3)
    rest = ff.static_equilibrium(pendulum)
    linear = ff.linearize(pendulum, rest)
    return [
        body,
        modes,
        reduced,
        large,
        crowd,
        pendulum,
        motion,
        motion.state(-1),
        rest,
        linear,
        ff.system_modes(linear),
    ]


def inside(value, seen):
    """Yield every data class instance that can be reached from a value."""
    if id(value) in seen or isinstance(value, np.ndarray | str) or sp.issparse(value):
        return
    seen[id(value)] = value
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        yield value
        for part in dataclasses.fields(value):
            yield from inside(getattr(value, part.name, None), seen)
    elif isinstance(value, list | tuple):
        for each in value:
            yield from inside(each, seen)
    elif isinstance(value, dict):
        for each in value.values():
            yield from inside(each, seen)


def test_public_objects_print_at_most_2000_characters_in_30_lines(objects):
    found = [each for each in inside(objects, {}) if type(each) in PUBLIC]
    long = {PUBLIC[type(each)]: len(repr(each)) for each in found if len(repr(each)) > LONGEST}
    tall = {PUBLIC[type(each)]: repr(each).count("\n") for each in found if repr(each).count("\n") >= MOST_LINES}
    assert (long, tall) == ({}, {})
    assert len({type(each) for each in found}) > 20


#: modules of arrays that the engine and the solvers hand to each other, and of single values
INTERNAL = ("floatframe.engine.", "cms.linear_algebra.", "fe_models.foundation.", "floatframe.results.small_motions.")


def returned_classes():
    """Return the data classes that public functions return, and what their methods and properties return in turn."""
    given = [each for package in ("fe_models", "cms", "floatframe") for each in public_objects(package).values()]
    waiting = [one for each in given if inspect.isroutine(each) for one in classes_in(hint_of(inspect.unwrap(each)))]
    found = set()
    while waiting:
        kind = waiting.pop()
        if kind in found or not kind.__module__.startswith(("fe_models.", "cms.", "floatframe.")):
            continue
        found.add(kind)
        for name in dir(kind):
            part = inspect.getattr_static(kind, name, None)
            method = getattr(part, "fget", None) or getattr(part, "func", None) or part
            if not name.startswith("_") and inspect.isfunction(method):
                waiting += classes_in(hint_of(method))
    return {each for each in found if dataclasses.is_dataclass(each) and not each.__module__.startswith(INTERNAL)}


def hint_of(function):
    """Return the annotation of what a function returns; None if a name in it is only known to type checkers."""
    try:
        return typing.get_type_hints(function).get("return")
    except NameError:
        return None


def classes_in(hint):
    """Yield the classes in an annotation."""
    if inspect.isclass(hint) and not typing.get_args(hint):
        yield hint
    for part in typing.get_args(hint):
        yield from classes_in(part)


def test_what_public_functions_return_shows_itself_in_notebooks():
    """Inputs that are returned, such as a joint or a material, show themselves as they are written."""
    inputs = {each for each in PUBLIC if not hasattr(each, "to_table")}
    found = returned_classes() - inputs
    assert len(found) > 40
    assert sorted(f"{each.__module__}.{each.__name__}" for each in found if not hasattr(each, "_repr_html_")) == []


def test_every_public_data_class_shows_itself_in_notebooks():
    assert [name for each, name in PUBLIC.items() if not hasattr(each, "_repr_html_")] == []
    page = ff.Marker("rod", "end")._repr_html_()
    assert "<b>Marker</b>" in page
    assert "interface</th><td style='text-align:left'>&#x27;end&#x27;</td>" in page
    assert "triad" not in page  # it has its default


def test_parts_of_a_motion_print_at_most_2000_characters(objects):
    motion = objects[6]
    joint, body = motion.joint("pin"), motion.body("rod")
    parts = [joint, joint.reaction, joint.drift, joint.coordinate("angle"), body, motion.energies, motion.head]
    tables = [motion.to_table(), Table({f"column of a long name {k}": np.arange(20.0) for k in range(100)})]
    for each in [*parts, *tables]:
        assert len(repr(each)) <= LONGEST, type(each)
        assert repr(each).count("\n") < MOST_LINES, type(each)
    assert "angle" in repr(joint)
    assert "... and 96 more columns" in repr(tables[1])


class Balanced(HTMLParser):
    """Counts tags that are open."""

    VOID = ("br",)

    def __init__(self):
        super().__init__()
        self.open = []

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_notebooks_show_a_table_of_each_object(objects):
    for each in objects:
        page = each._repr_html_()
        parser = Balanced()
        parser.feed(page)
        assert parser.open == []
        assert "<table" in page


def test_what_a_reduced_body_shows_are_its_numbers(objects):
    reduced = objects[2]
    text = repr(reduced)
    assert f"{reduced.moments.m:.6g} kg" in text
    assert f"{reduced.frequencies[0]:.6g}" in text
    assert reduced.labels[0] in text
    assert "left, right" in text
    assert "centre of mass  (0, 0, 0) m in the frame" in text  # mean axes


def test_a_frequency_in_other_time_units_is_shown_in_hertz():
    body = synthetic_reduced_body(n_q=3, units="mm-kg-ms")
    assert f"{1000 * body.frequencies[0]:.6g}" in repr(body)


def test_the_modes_of_a_system_show_hertz_and_damping(objects):
    modes = objects[-1]
    assert f"{modes.frequencies[0]:.6g}" in repr(modes)
    assert "stable" in repr(modes)


@presented
@dataclasses.dataclass(frozen=True, eq=False)
class Sample:
    name: str
    numbers: np.ndarray
    many: tuple[int, ...] = ()
    same: float = 1.0
    hidden: int = dataclasses.field(default=3, repr=False)


def test_fields_with_their_default_are_not_shown():
    assert repr(Sample("a", np.array([1.0, 2.5]))) == "Sample(name='a', numbers=[1, 2.5])"
    text = repr(Sample("a", np.zeros((40, 3)), tuple(range(50)), 2.0))
    assert all(part in text for part in ("array (40, 3)", "50 items", "same=2"))
    assert "hidden" not in text


def test_text_of_a_notebook_is_escaped():
    assert "<b>a &lt;b&gt;</b>" in Summary("a <b>", [("<i>", "&")]).html()


def test_long_tables_are_cut():
    table = Summary("t", (), ("a",), [(str(k),) for k in range(100)])
    assert table.text().count("\n") == MOST_ROWS + 2
    assert f"... and {100 - MOST_ROWS} more" in table.html()


@pytest.mark.parametrize("value", ["x" * 500, [0, 1, "y" * 500], {"a": "z" * 500}, np.arange(12) * 1e7 / 3])
def test_every_value_takes_one_short_line(value):
    assert len(text_of(value)) <= LONGEST_VALUE
    assert "\n" not in text_of(value)

"""Pickled and deep copies: equal in every field, read-only as the first, and usable."""

import copy
import importlib
import pickle
import pkgutil
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import cms
import fe_models
import floatframe
from fe_models.foundation.errors import ReportedError
from fe_models.foundation.records import FrozenMapping
from floatframe import GROUND, FlexibleBody, GeneralizedAlpha, RevoluteJoint, System, integrate
from floatframe.components.mechanisms import slider_crank
from floatframe.errors import ConvergenceError
from tests.bodies import box_mesh
from tests.floatframe.results.examples import SYSTEM
from tests.synthetic import synthetic_reduced_body

WAYS = {"pickle": lambda value: pickle.loads(pickle.dumps(value)), "deep copy": copy.deepcopy}


def differences(a, b, where="it"):
    """Return where two values differ in type or content, or where the second can be written to."""
    if type(a) is not type(b):
        return [f"{where}: {type(b).__name__}"]
    if isinstance(a, np.ndarray):
        same = a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
        return [] if same and not b.flags.writeable else [where]
    if is_dataclass(a):
        return [d for f in fields(a) for d in differences(getattr(a, f.name), getattr(b, f.name), f"{where}.{f.name}")]
    if isinstance(a, FrozenMapping | dict):
        keys = [] if list(a) == list(b) else [where]
        return keys + [d for key in a for d in differences(a[key], b[key], f"{where}[{key}]")]
    if isinstance(a, tuple | list):
        length = [] if len(a) == len(b) else [where]
        pairs = enumerate(zip(a, b, strict=False))
        return length + [d for k, pair in pairs for d in differences(*pair, f"{where}[{k}]")]
    return [] if a == b else [where]


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("value", [
    synthetic_reduced_body(),
    FlexibleBody("rod", synthetic_reduced_body(), velocity=(1, 2, 3)),
    box_mesh(2, 1, 1, 1.0, 1.0, 1.0, "hexahedron"),
    slider_crank(angle=0.2),
    SYSTEM,
], ids=["ReducedBody", "FlexibleBody", "Mesh", "System of rigid bodies", "System"])  # fmt: skip
def test_copies_are_equal_and_read_only(value, way):
    assert differences(value, WAYS[way](value)) == []


@pytest.mark.parametrize("way", WAYS)
def test_a_copied_system_moves_as_the_first_also_after_it_was_compiled(way):
    method = GeneralizedAlpha()
    first = integrate(SYSTEM, method, 0.02, 1e-3)
    again = integrate(WAYS[way](SYSTEM), method, 0.02, 1e-3)
    assert_array_equal(first.source.read("q"), again.source.read("q"))
    motion = WAYS[way](first)
    assert_array_equal(motion.body("rod").q, first.body("rod").q)


def test_a_frozen_mapping_cannot_be_changed_and_joins_like_a_dict():
    one = FrozenMapping({"a": 1})
    with pytest.raises(TypeError):
        one["b"] = 2
    assert one == {"a": 1}
    assert one | {"b": 2} == {"a": 1, "b": 2}
    assert {"a": 0, "b": 2} | one == {"a": 1, "b": 2}


def kinds_of_errors():
    for package in (fe_models, cms, floatframe):
        for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
            if not module.name.endswith(("__main__", "worker")):
                importlib.import_module(module.name)
    known, waiting = [], [ReportedError]
    while waiting:
        kind = waiting.pop()
        known.append(kind)
        waiting += kind.__subclasses__()
    return {kind.__qualname__: kind for kind in known if kind.__module__.split(".")[0] != "tests"}


@pytest.mark.parametrize("way", WAYS)
def test_every_error_can_be_copied_with_its_text(way):
    kinds = kinds_of_errors()
    assert len(kinds) > 20
    for kind in kinds.values():
        error = kind.__new__(kind, "what, where")
        error.note = 3
        again = WAYS[way](error)
        assert type(again) is kind
        assert str(again) == "what, where"
        assert again.note == 3
    motion = integrate(SYSTEM, GeneralizedAlpha(), 0.01, 1e-3)
    failure = WAYS[way](ConvergenceError("no", t=1.0, h=0.1, residual=3.0, trajectory=motion))
    assert (failure.t, failure.h, failure.residual) == (1.0, 0.1, 3.0)
    assert_array_equal(failure.trajectory.t, motion.t)


def test_replaced_copies_stay_what_they_are():
    joint = RevoluteJoint("pin", GROUND, SYSTEM.joints[0].marker_b, axis=(0, 0, 2.0))
    system = replace(SYSTEM, joints=(joint, *SYSTEM.joints[1:]))
    assert isinstance(WAYS["pickle"](system), System)
    assert differences(system, WAYS["pickle"](system)) == []

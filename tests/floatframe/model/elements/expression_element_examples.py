"""Systems, bodies and helpers that several tests share: expression element."""

import numpy as np

from floatframe.model.elements.expressions import ExpressionElement
from tests.floatframe.model.elements.public_elements_examples import ENDS, HELD, sprung

TERMS = {
    "length": "sqrt(b_x^2 + b_y^2 + b_z^2)",
    "rate": "(b_x*b_vx + b_y*b_vy + b_z*b_vz)/length",
    "tension": "k*(length - free) + c*rate + preload",
}


def spring(name, ends, k, c, preload, free):
    return ExpressionElement(
        name, dict(zip("ab", ends, strict=True)), terms=TERMS,
        forces={f"b_F{axis}": f"-tension*b_{axis}/length" for axis in "xyz"},
        outputs={"energy": "k*(length - free)^2/2 + preload*length", "lost": "c*rate^2"},
        parameters={"k": k, "c": c, "preload": preload, "free": free}, energy="energy", power_lost="lost",
    )  # fmt: skip


def as_expressions():
    places_of = {"a": np.array([1, 0, 0]), "b": np.array([2, 0.3, 0]), "ground": np.zeros(3)}
    free = [
        float(np.linalg.norm(places_of[b.body] + b.position - places_of[getattr(a.body, "name", a.body)] - a.position))
        for a, b in (ENDS, HELD)
    ]
    return sprung([spring("s", ENDS, 200.0, 1.0, 1.0, free[0]), spring("g", HELD, 300.0, 2.0, 1.0, free[1])])

"""Systems and motions for the tests of generated code, what the model says of them, and calls in every language."""

import ctypes
import math
import operator
import re
import subprocess

import numpy as np
from numpy.testing import assert_allclose

import floatframe as ff
from floatframe.design.generation.generate import generate
from floatframe.design.generation.graph import ADD, CONSTANT, COS, DIV, MUL, NEG, SIN, SUB, SYMBOL, reachable
from floatframe.design.generation.routines import ROUTINES
from tests.floatframe.design.identification.robots import random_tree, six_axes
from tests.floatframe.engine.tree.random_trees import KINDS, system_of
from tests.floatframe.engine.tree.random_trees import random_tree as random_links

ROUNDOFF = 1e-12
N_STATES = 3


def puma():
    return six_axes()


def all_charts():
    return system_of(random_links(9, np.random.default_rng(3), kinds=KINDS[:-1], free_base=True))


def screws():
    return system_of(random_links(5, np.random.default_rng(7), kinds=("screw", "screw", "fixed")))


def few():
    """A small tree of a ball and a screw that is given backwards: for what is slow to compile."""
    return system_of(random_links(2, np.random.default_rng(2), kinds=("screw", "spherical")))


def wheels():
    """A frame on a hinge with wheels: round, out of balance, oval, and one that carries a body on a hinge in line."""
    rng = np.random.default_rng(2)
    bodies = [ff.RigidBody("frame", 5.0, np.diag([0.3, 0.4, 0.5]), (0.1, 0.05, 0.0))]
    joints = [ff.RevoluteJoint("roll", ff.GROUND, ff.Marker("frame"), axis=(1, 0, 0))]
    for name, center, J_x in (  # P of the unbalanced one is round, m c cᵀ with it
        ("round", (0, 0.02, 0), 0.1), ("unbalanced", (0.01, 0, 0), 0.1002), ("oval", (0, 0, 0), 0.13),
        ("carrier", (0, 0, 0), 0.1),
    ):  # fmt: skip
        at = ff.Marker("frame", position=rng.normal(size=3))
        bodies.append(ff.RigidBody(name, 2.0, np.diag([J_x, 0.15, 0.1]), center, position=at.position))
        joints.append(ff.RevoluteJoint(f"hub {name}", at, ff.Marker(name), axis=(0, 1, 0)))
    swing = ff.RevoluteJoint("swing", ff.Marker("carrier", position=(0, 0.2, 0)), ff.Marker("bob"), axis=(0, 1, 0))
    place = np.asarray(bodies[-1].position) + np.array([0, 0.2, 0])
    bodies.append(ff.RigidBody("bob", 0.5, np.diag([0.01, 0.02, 0.015]), (0.1, 0, 0.03), position=place))
    return ff.System(bodies, [*joints, swing], [ff.Gravity((0.2, -0.1, -9.81))], name="wheels")


def balls():
    """Two bodies on spherical joints that are given from the body to what carries it."""
    rng = np.random.default_rng(6)
    bodies, joints, below = [], [], "ground"
    for name in ("upper", "lower"):
        J = np.diag([0.2, 0.3, 0.25])
        bodies.append(ff.RigidBody(name, 1.5, J, 0.2 * rng.normal(size=3), orientation=(0.8, 0.6, 0, 0)))
        own, other = ff.Marker(name, position=0.2 * rng.normal(size=3)), ff.Marker(below, position=rng.normal(size=3))
        joints.append(ff.SphericalJoint(f"ball {name}", own, other))
        below = name
    return ff.System(bodies, joints, [ff.Gravity((0.2, -0.1, -9.81))], name="balls")


SYSTEMS = {
    "six axes": puma,
    "all charts, free base": all_charts,
    "parallel axes": lambda: random_tree(4, 6, "RPCU"),
    "screws": screws,
    "wheels": wheels,
    "balls": balls,
}


class Case:
    """A system, its model and random motions: z, z_dot, z_ddot, force."""

    def __init__(self, system, n=N_STATES):
        self.system, self.model = system, ff.analyses.relative_model(system)
        self.motions = []
        start, n_rates = self.model.positions()[0], self.model.n_rates
        for seed in range(n):
            rng = np.random.default_rng(seed)
            z = self.model.moved(start, rng.normal(size=n_rates))
            self.motions.append((z, *rng.normal(size=(3, n_rates))))
        self.z, self.z_dot, self.z_ddot, self.force = self.motions[0]


def near(got, expected, factor=1.0):
    expected = np.asarray(expected)
    assert_allclose(got, expected, rtol=0, atol=factor * ROUNDOFF * np.abs(expected).max())


def arguments(what, motion):
    """Return the inputs of a routine in a motion."""
    named = dict(zip(("z", "z_dot", "z_ddot", "force"), motion, strict=True))
    return [named[name] for name in ROUTINES[what].inputs]


def expected(case, what, motion):
    """Return what the model says, output by output, and the factor of rounding that its condition allows."""
    (z, z_dot, z_ddot, force), model = motion, case.model
    if what == "kinematics":
        places = [model.pose(z, ff.Marker(body.name)) for body in case.system.bodies]
        rates = [model.jacobian(z, ff.Marker(body.name)) @ z_dot for body in case.system.bodies]
        r, R = (np.array(each) for each in zip(*places, strict=True))
        return [r, R, np.array(rates)[:, :3], np.array(rates)[:, 3:]], 100.0
    if what == "forward":
        return [model.forward_dynamics(z, z_dot, force)], np.linalg.cond(model.mass_matrix(z))
    if what == "jacobian":
        return list(model.derivatives(z, z_dot, z_ddot)), 1.0
    if what == "mass":
        return [model.mass_matrix(z)], 1.0
    tau = model.inverse_dynamics(z, z_dot, z_ddot)
    return [tau - force if what == "residual" else tau], 1.0


def agree(got, case, what, motion):
    """Require outputs to be those of the model."""
    outputs, factor = expected(case, what, motion)
    for one, other in zip(got, outputs, strict=True):
        near(np.asarray(one).reshape(other.shape), other, factor)


def python_function(system, what, **options):
    """Return the generated function itself."""
    code = generate(system, what=what, language="python", name="generated", **options)
    return python_call(code)


def python_call(code, folder=None):
    space = {}
    exec(compile(code.files[f"{code.name}.py"], f"{code.name}.py", "exec"), space)
    return space[code.name]


def c_function(code, folder):
    """Compile as asked for, and return a function of arrays; the outputs come first."""
    paths = code.write(folder)
    library = folder / f"{code.name}.so"
    command = ["cc", "-O2", "-Wall", "-Wextra", "-Wno-unused-parameter", "-std=c99", "-pedantic", "-Werror", "-shared"]
    subprocess.run([*command, "-fPIC", str(paths[0]), "-o", str(library), "-lm"], check=True)
    function = getattr(ctypes.CDLL(str(library)), code.name)

    def run(out, *arrays):
        held = [np.ascontiguousarray(each, dtype=float) for each in arrays]
        function(*(ctypes.c_void_p(each.ctypes.data) for each in (*held, *out)))

    return run


def c_call(code, folder):
    run = c_function(code, folder)

    def call(*arrays):
        out = [np.full(shape, np.nan) for shape in code.outputs.values()]
        run(out, *arrays)
        return out

    return call


def casadi_call(code, folder):
    function = python_call(code)()

    def call(*arrays):
        out = function(*arrays)
        return [np.array(each) for each in (out if isinstance(out, tuple) else (out,))]

    return call


def matlab_call(code, folder):
    return matlab_function(code.files[f"{code.name}.m"])


def matlab_function(text):
    """Read a generated MATLAB function by indices from 1 and matrices of rows; return it as one of Python."""
    lines = [line for line in text.splitlines() if not line.startswith("%")]
    outs, inputs = re.fullmatch(r"function \[(.*)\] = \w+\((.*)\)", lines[0]).groups()
    assert lines[-1] == "end"
    names = "|".join(inputs.split(", "))
    statements, rows = [], None
    for line in lines[1:-1]:
        line = re.sub(rf"\b({names})\((\d+)\)", lambda found: f"{found[1]}[{int(found[2]) - 1}]", line.strip())
        assert line.endswith((";", "["))
        if line.endswith("= ["):
            name, rows = line.split()[0], []
        elif line == "];":
            statements.append(f"{name} = [{', '.join(rows)}]")
        elif line.startswith("("):
            rows.append(f"[{line[:-1]}]")
        else:
            statements.append(line[:-1])

    def call(*values):
        space = dict(zip(inputs.split(", "), values, strict=True)) | {"sin": math.sin, "cos": math.cos}
        for statement in statements:
            exec(statement, space)
        return [np.array(space[name]) for name in outs.split(", ")]

    return call


OPERATIONS = {
    ADD: operator.add, SUB: operator.sub, MUL: operator.mul, DIV: operator.truediv, NEG: operator.neg, SIN: np.sin,
    COS: np.cos,
}  # fmt: skip


def values_of(outputs, inputs):
    """Evaluate terms, operation by operation; inputs: name of a symbol -> number, complex ones too."""
    value = {}
    for term in reachable(outputs):
        if term.kind == CONSTANT:
            value[term.index] = term.value
        elif term.kind == SYMBOL:
            value[term.index] = inputs[term.name]
        else:
            value[term.index] = OPERATIONS[term.kind](*(value[each.index] for each in term.args))
    return np.array([value[term.index] for term in outputs])


CALLS = {"c": c_call, "python": python_call, "casadi": casadi_call, "matlab": matlab_call}


def outputs_of(result):
    """Return the result of a call as a list of outputs."""
    return list(result) if isinstance(result, tuple | list) else [result]

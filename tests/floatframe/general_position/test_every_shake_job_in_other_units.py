"""Shake jobs in other units, off the origin and turned: every test of a job shows what it shows in SI."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

import cms
from cms.body.modal_file.file import convert_units
from fe_models.body.fe_body import Interface
from fe_models.foundation.units import unit_system
from floatframe import GROUND, FixedJoint, FlexibleBody, Gravity, Marker, RigidBody, System
from floatframe.durability.shaking.loads.levels import Level
from floatframe.durability.shaking.loads.notching import ForceLimit, ResponseLimit
from floatframe.durability.shaking.loads.random_vibration import CrossSpectrum, RandomTest
from floatframe.durability.shaking.loads.shock import SpectrumRequest, TimeTest
from floatframe.durability.shaking.loads.sine import SineTest
from floatframe.durability.shaking.loads.uncertainty import Uncertainty
from floatframe.durability.shaking.shake import NotchRequest, ShakeJob, model_of, shake
from floatframe.durability.shaking.structure.damping import Damping
from floatframe.durability.shaking.structure.model import response
from floatframe.durability.shaking.structure.places import Observed
from floatframe.forces import Bushing
from floatframe.results.sensors import PlaceSensor, ReactionSensor, SpringSensor
from tests.bodies import beam, with_interfaces
from tests.floatframe.other_units import Other, in_units

R = Rotation.from_rotvec([0.7, -0.4, 1.1]).as_matrix()
PLACE = np.array([300.0, -200.0, 150.0])
POINT, OTHER_POINT = np.array([0.3, 0.2, -0.1]), np.array([0.9, -0.2, 0.1])
SQUARES = {"acceleration": "m/s^2", "displacement": "m", "rotation": "rad", "force": "N", "moment": "N m",
           "net force": "N", "stress": "Pa", "angular acceleration": "1/s^2", "von Mises": "Pa"}  # fmt: skip
CLOSE = {"body": 1e-6, "system": 1e-5}  #: of the largest output; supports of a system act against each other
EVERY = ("acceleration", "displacement", "stress")


@cache
def rod():
    """A beam with damping, stress, kept nodes and a recovery table, whose frame lies turned in its mesh."""
    places = (("left", 0), ("middle", 2), ("right", 3))
    held = [Interface(name, "nodes", np.array([k]), np.array([k / 3, 0, 0])) for name, k in places]
    part = cms.couple(with_interfaces(beam(n=3), *held))
    rows = (cms.reduction.Rows("acceleration", at=("middle",)), cms.reduction.Rows("net force", about=(0.1, 0.2, 0.0)))
    table = cms.reduction.RecoveryRequest("table", rows=rows)
    body = cms.reduce(
        part, cms.craig_bampton(part, n_modes=4), damping=cms.reduction.ModalDamping(0.03), recovery=[table]
    )
    stress = 1e9 * np.random.default_rng(4).normal(size=(len(body.nodes), 6, body.n_q))
    return replace(body, stress=stress)


def structure(kind, units="m-kg-s", turn=None, place=None):
    """Return the rod alone, or the rod with a block on a foot and a mount; turned by R and moved by a place [m]."""
    other = Other(unit_system(units))
    R, r = np.eye(3) if turn is None else turn, np.zeros(3) if place is None else place
    if kind == "body":
        body = convert_units(rod(), other.units)
        frame = body.frame
        return replace(body, frame=replace(frame, origin=R @ frame.origin + r * other.factor("m"), axes=R @ frame.axes))
    triad = Rotation.from_rotvec([0.2, 0.5, -0.3]).as_matrix()
    block = RigidBody("block", 2.0, np.diag([0.02, 0.03, 0.04]), (0.05, 0.02, 0.01), position=(1.0, 0, 0))
    K = np.diag([3e5, 2e5, 4e5, 3e3, 2e3, 2.5e3]) + 50.0
    joints = [FixedJoint("foot", Marker(GROUND, position=np.zeros(3)), Marker("rod", "left")),
              FixedJoint("weld", Marker("rod", "right"), Marker("block"))]  # fmt: skip
    there = Marker(GROUND, position=(1.0, 0.2, 0.1), triad=triad)
    mount = Bushing("mount", there, Marker("block", position=(0, 0.2, 0.1), triad=triad), K, 1e-3 * K)
    whole = System([FlexibleBody("rod", rod()), block], joints, [Gravity((0, 0, 0)), mount])
    found = in_units(whole, other.units, R, r)
    sensors = [ReactionSensor("reaction", "foot", "marker"), SpringSensor("spring", "mount"),
               PlaceSensor("place", Marker("block", position=(0.1, 0, 0)), "acceleration")]  # fmt: skip
    return replace(found, sensors=[other.part(each) for each in sensors if not isinstance(each, SpringSensor)])


def job(kind, units="m-kg-s", turn=None, place=None, own=False):
    """Return a job with every kind of test, output, limit and option."""
    other = Other(unit_system(units))
    R, r, long = np.eye(3) if turn is None else turn, np.zeros(3) if place is None else place, other.factor("m")
    a = "right" if kind == "body" else "mount"
    if kind == "body":
        seen = [
            Observed("tip", interface="middle" if own else "right", quantities=EVERY[:2]),
            Observed("node", position=(R @ np.array([2 / 3, 0, 0]) + r) * long, quantities=EVERY),
            Observed("table", recovery="table"),
        ]
        bases = {"left": ("left",)} if not own else {"left": ("left",), "right": ("right",)}
    else:
        seen = [
            Observed("tip", body="rod", interface="right", quantities=EVERY[:2]),
            Observed("node", body="rod", position=np.array([1.0, 0, 0]) * long, quantities=("acceleration",)),
            Observed("corner", body="block", position=np.array([0.1, 0.2, 0.3]) * long, quantities=EVERY[:2]),
            Observed("reaction", sensor="reaction"),
            Observed("place", sensor="place"),
        ]
        bases = {"left": ("foot",), "mount": ("mount",)}
    axis = {direction: f"left:{direction}" for direction in ("x", "z", "ry")}
    g2 = Level([10.0, 60.0, 800.0], [2e-3, 0.04, 1e-3], "g2/Hz")
    turning = Level([10.0, 900.0], [3.0, 0.5], "(rad/s2)2/Hz")
    t = np.linspace(0, 0.05, 120)
    pulse = 100.0 * np.sin(np.pi * np.clip(t / 0.02, 0, 1)) ** 2
    inputs = {axis["z"]: pulse, axis["ry"]: 3 * pulse[::-1]}
    if kind == "body" and not own:
        inputs["right:y"] = 2 * pulse
    elif len(bases) > 1:
        inputs[f"{a}:x"] = 0.5 * pulse
    limits = [
        ResponseLimit("tip acceleration z", level=4.0, name="tip"),
        ResponseLimit("left force z", level=60.0 * other.factor("N"), name="foot"),
        ForceLimit("left force x", C=1.2, mass=3.0 * other.factor("kg"), name="semi"),
    ]
    table = Level([5.0, 900.0], [9.0, 4.0], "m/s2")
    limits.append(ResponseLimit("node acceleration z", table=table, name="table"))
    wide = [ResponseLimit("tip acceleration z", rms=2.0, name="rms"), ForceLimit("left force z", C=1.5, name="semi")]
    return ShakeJob(
        structure(kind, units, turn, place),
        bases,
        {"left": (R @ POINT + r) * long},
        Damping(own=True) if own else Damping(table=[(5.0, 0.03), (900.0, 0.06)], modes={2: 0.02}),
        seen,
        sine=[
            SineTest("sweep", Level([5.0, 40.0, 900.0], [0.5, 2.0, 1.0], "g"), ["left:x", "left:z"],
                      rate=400.0 if len(bases) == 1 else None),
            SineTest("stroke", Level([5.0, 300.0], [2e-3, 2e-4], "mm"), ["left:z"]),
            SineTest("turning", Level([5.0, 300.0], [8.0, 4.0], "rad/s2"), ["left:ry"]),
        ],
        random=[
            RandomTest("one", g2, ["left:z"], duration=60.0),
            RandomTest("all", levels={axis["x"]: g2, axis["ry"]: turning}, duration=30.0,
                       cross=[CrossSpectrum(axis["x"], axis["ry"], 0.6, 40.0)]),
        ],
        shock=[
            TimeTest("shock", t, pulse, ["left:z"], spectra=SpectrumRequest(last=300.0, per_octave=3), kind="shock"),
            TimeTest("transient", t, inputs=inputs, after=0.02, spectra=SpectrumRequest(last=300.0, per_octave=3)),
        ],
        notch=[] if own else [NotchRequest(limits, "sine", ["sweep"]), NotchRequest(wide, "random", ["one"])],
        uncertainty=Uncertainty(1.2, 0.05, [(30.0, 100.0, 1.3, 0.08)]),
        residual_above=1500.0 if own else 400.0,
    )  # fmt: skip


def unit_of_input(name):
    """Return the SI unit of an input."""
    return ("1/s^2" if name[-2] == "r" else "m/s^2") if name.startswith(("left", "mount")) else "N"


def numbers(kind, own, units):
    """Return every array of the result of a job in SI, by name; of the job off the origin unless it is the SI form."""
    is_si = units == "m-kg-s"
    job_there = job(kind, units, place=None if is_si else PLACE, own=own)
    result, other = shake(job_there), Other(unit_system(units))
    found = {"modes": result.masses.frequencies, "ratios": result.masses.damping}
    six = np.tile([1.0] * 3 + [other.factor("m") ** 2] * 3, len(result.model.bases)) * other.factor("kg")
    found |= {"effective": result.masses.mass / six, "total": result.masses.total / six}

    def outputs(run):
        return np.array([other.factor(unit_of_output(each)) for each in run.outputs])

    def unit(name):
        right_as_force = kind == "body" and not own and name.startswith("right")
        return other.factor("N" if right_as_force else "1/s^2" if ":r" in name else "m/s^2")

    for run in result.sine:
        name, of = f"sine {run.test} {run.direction}", outputs(run)
        found |= {f"{name} {key}": getattr(run, key) / of for key in ("sizes", "uncertain", "static", "peaks")}
        found |= {f"{name} level": run.level / unit(run.direction)}
        if run.swept is not None:
            found[f"{name} swept"] = run.swept_peaks / of
    for run in result.random:
        name, of = f"random {run.test}", outputs(run)
        found |= {f"{name} {key}": getattr(run, key) / of for key in ("rms", "uncertain", "expected")}
        found |= {f"{name} {key}": getattr(run, key) / of**2 for key in ("density", "wide")}
        given = np.array([unit(each) for each in run.inputs])
        rms = run.rms / of
        kinds = np.array([unit_of_output(each) for each in run.outputs])
        moves = rms > 1e-4 * np.array([rms[kinds == each].max() for each in kinds])  # others are rounding
        moves &= kind == "body"  # small forces of a system are differences of large ones
        found |= {f"{name} crossings": run.crossings * moves, f"{name} level": run.level / given**2}
        found |= {f"{name} input": run.input_rms / given, f"{name} miles": np.array([m.grms for m in run.miles])}
        if run.field is not None:
            found[f"{name} field"] = run.field / other.factor("Pa")
    for run in result.time:
        name, of = f"time {run.test}", outputs(run)
        found |= {f"{name} peaks": run.peaks / of, f"{name} uncertain": run.uncertain / of, f"{name} t": run.t}
        given = np.array([unit(each) for each in run.inputs])
        found |= {f"{name} inputs": run.input_values / given[:, None]}
        speed = given * other.factor("s")
        found |= {f"{name} velocity left": run.velocity_left / speed}
        found |= {f"{name} displacement left": run.displacement_left / (speed * other.factor("s"))}
        for of_signal, spectra in run.spectra.items():
            of_output = next((other.factor(unit_of_output(o)) for o in run.outputs if o.name == of_signal), None)
            scale = unit(of_signal) if of_output is None else of_output
            found |= {f"{name} spectrum of {of_signal} {Q}": values / scale for Q, values in spectra.items()}
    for (of_kind, test, direction), run in result.notched.items():
        name, power = f"notched {of_kind} {test} {direction}", 2 if of_kind == "random" else 1
        found |= {f"{name} level": run.notched / unit(direction) ** power}
        found |= {f"{name} depths": np.array([[n.first, n.last, n.depth] for n in run.notches]).ravel()}
    return found


def unit_of_output(output):
    """Return the SI unit of an output."""
    kind = output.kind
    if kind in SQUARES:
        return SQUARES[kind]
    raise AssertionError(f"no unit for outputs of the kind {kind!r} [{output.unit}]")


@cache
def in_si(kind, own):
    return numbers(kind, own, "m-kg-s")


@pytest.mark.parametrize(
    ("kind", "own", "units"),
    [*((kind, False, units) for kind in ("body", "system") for units in ("mm-kg-ms", "in-slinch-s")),
     pytest.param("body", False, "mm-t-s", marks=pytest.mark.long),
     ("body", True, "mm-kg-ms"), ("system", True, "mm-kg-ms")],
)  # fmt: skip
def test_a_shake_job_shows_the_same_in_other_units_and_off_the_origin(kind, own, units):
    a, b = in_si(kind, own), numbers(kind, own, units)
    assert set(a) == set(b)
    for name, values in a.items():
        may_vanish = not values.size or name.endswith((" left", "crossings"))
        assert may_vanish or np.nanmax(np.abs(values)) > 0, name
        scale = np.nanmax(np.abs(values), initial=0.0)
        assert_allclose(b[name], values, rtol=1e-5, atol=CLOSE[kind] * scale, err_msg=name)


def turned_by(outputs):
    """Return the matrix that turns outputs in threes, and stress of six components, by R."""
    blocks, k = [], 0
    while k < len(outputs):
        if outputs[k].kind == "stress":
            pairs = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
            S = np.array([[R[i, m] * R[j, n] + (R[i, n] * R[j, m] if m != n else 0) for m, n in pairs]
                          for i, j in pairs])  # fmt: skip
            blocks.append(S)
        else:
            blocks.append(R)
        k += len(blocks[-1])
    return block_diag(*blocks)


@pytest.mark.parametrize("kind", ["body", "system"])
def test_responses_of_a_turned_structure_are_those_of_the_structure_turned(kind):
    f = np.array([4.0, 33.0, 170.0])
    here, there = model_of(job(kind), ()), model_of(job(kind, "mm-kg-ms", R, PLACE), ())
    other = Other(unit_system("mm-kg-ms"))
    # rows of tables and forces on markers have axes of their own
    kept = [k for k, each in enumerate(here.outputs)
            if not each.place.startswith("recovery") and not each.name.startswith("reaction")]  # fmt: skip
    outputs = [here.outputs[k] for k in kept]
    assert [each.name for each in outputs] == [there.outputs[k].name for k in kept]
    seen = np.array([other.factor(unit_of_output(each)) for each in outputs])
    given = np.array([other.factor("1/s^2" if ":r" in name else "m/s^2") for name in here.inputs])
    a, b = response(here, f)[:, kept], response(there, f)[:, kept] * given / seen[:, None]
    n = len(here.inputs) // 3
    expected = turned_by(outputs) @ a @ block_diag(*[R] * n).T
    for k, each in enumerate(outputs):
        assert_allclose(b[:, k], expected[:, k], rtol=0, atol=1e-6 * np.abs(expected[:, k]).max(), err_msg=each.name)

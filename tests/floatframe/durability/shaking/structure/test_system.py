"""Systems on bases: a body in a system is the body alone, and small motions are those of the time integration."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import cms
import fe_models as fm
import floatframe as ff
from floatframe.durability.shaking.loads.shock import TimeTest, time_runs
from floatframe.durability.shaking.structure.body import bases_of_body, shaken_body
from floatframe.durability.shaking.structure.damping import Damping
from floatframe.durability.shaking.structure.model import response
from floatframe.durability.shaking.structure.places import Observed
from floatframe.durability.shaking.structure.system import bases_of_system, shaken_system
from floatframe.errors import ModelError
from floatframe.model.functions.tables import acceleration_table
from tests.bodies import beam

F = np.array([1.0, 8.0, 31.0, 90.0, 400.0])


@pytest.fixture(scope="module")
def rod():
    part = cms.couple(beam(n=3))
    return cms.reduce(
        part, cms.craig_bampton(part, n_modes=6), frame=cms.NodalFrame("left"), damping=cms.reduction.ModalDamping(0.03)
    )


def on_ground(rod, *extra, **more):
    joint = ff.FixedJoint("foot", ff.Marker(ff.GROUND), ff.Marker("rod", "left"))
    return ff.System([ff.FlexibleBody("rod", rod), *more.get("bodies", ())], [joint, *more.get("joints", ())], extra)


def test_a_body_fixed_in_a_system_is_the_body_alone(rod):
    system = on_ground(rod)
    tip = {"interface": "right", "quantities": ("acceleration", "displacement")}
    for damping in (Damping(ratio=0.02), Damping(own=True)):
        alone = shaken_body(rod, bases_of_body(rod, "left"), damping, [Observed("tip", **tip)])
        model = shaken_system(system, bases_of_system(system, None), damping, [Observed("tip", body="rod", **tip)])
        assert_allclose(model.omega, alone.omega, rtol=1e-8)
        assert_allclose(model.mass, alone.mass, rtol=0, atol=1e-8 * alone.mass.max())
        wanted = {output.name.replace("left", "base"): k for k, output in enumerate(alone.outputs)}
        chosen = [wanted[output.name] for output in model.outputs]
        expected, found = response(alone, F)[:, chosen], response(model, F)
        assert_allclose(found, expected, rtol=0, atol=1e-7 * np.abs(expected).max(axis=(0, 2), keepdims=True).max())
        for k, output in enumerate(model.outputs):
            (
                assert_allclose(found[:, k], expected[:, k], rtol=0, atol=1e-6 * np.abs(expected[:, k]).max() + 1e-12),
                output,
            )
        shares = (model.B[2] ** 2).sum(axis=0), (alone.B[2] ** 2).sum(axis=0)
        assert_allclose(*shares, rtol=1e-6, atol=1e-9 * shares[1].max())


@pytest.mark.parametrize("frame", [cms.NodalFrame("left"), cms.TisserandFrame()], ids=["nodal", "mean axes"])
def test_the_force_of_a_base_has_the_damping_of_the_modes_in_every_frame(frame):
    part = cms.couple(beam(n=3))
    body = cms.reduce(part, cms.craig_bampton(part, n_modes=6), frame=frame)
    alone = shaken_body(body, bases_of_body(body, "left"), Damping(Q=5))
    system = replace(on_ground(body), sensors=[ff.sensors.ReactionSensor("load", "foot")])
    model = shaken_system(system, bases_of_system(system, None), Damping(Q=5), [Observed("load", sensor="load")])
    f = alone.omega[:3] / (2 * np.pi)
    force, mass = response(alone, f)[:, :6], float(body.moments.m)
    found = response(model, f)
    assert_allclose(found[:, :6], force, rtol=0, atol=1e-6 * np.abs(force).max(axis=(0, 2), keepdims=True).max())
    names = [output.name for output in model.outputs]
    mean = found[:, names.index("mean acceleration x") :][:, :3]
    assert_allclose(mass * mean, force[:, :3], rtol=0, atol=1e-6 * np.abs(force[:, :3]).max())
    load = found[:, [names.index(f"load force {axis}") for axis in "xyz"]]
    assert_allclose(np.abs(load), np.abs(force[:, :3]), rtol=0, atol=1e-6 * np.abs(force[:, :3]).max())


def test_net_force_of_two_bases_is_the_mass_times_the_acceleration_of_the_whole(rod):
    block = ff.RigidBody("block", 2.0, np.eye(3) * 0.01, position=(1.0, 0.0, 0.0))
    weld = ff.FixedJoint("weld", ff.Marker("rod", "right"), ff.Marker("block"))
    spring = ff.forces.Bushing(
        "spring",
        ff.Marker(ff.GROUND, position=(1.0, 0, 0)),
        ff.Marker("block"),
        np.diag([1e4] * 3 + [50.0] * 3),
        np.diag([5.0] * 3 + [0.1] * 3),
    )
    system = on_ground(rod, ff.Gravity((0, 0, -9.81)), spring, bodies=[block], joints=[weld])
    bases = bases_of_system(system, {"a": ("foot",), "b": ("spring",)})
    model = shaken_system(system, bases, Damping(own=True), [Observed("block", body="block", position=(0, 0, 0))])
    names = [output.name for output in model.outputs]
    total, _ = response(model, F), None
    one = shaken_system(system, bases_of_system(system, None, {"base": (0.0, 0.0, 0.0)}), Damping(own=True))
    # both bases moved alike are one base: forces add up, moments about the point of the first
    for k in range(3):
        together = total[:, :, k] + total[:, :, 6 + k]
        net = together[:, names.index("net force x") : names.index("net force x") + 6]
        single = response(one, F)[:, :6, k]
        assert_allclose(net, single, rtol=0, atol=1e-7 * np.abs(single).max())
    assert_allclose(one.mass[0, 0], 2.0 + float(rod.moments.m), rtol=1e-12)
    low = response(one, np.array([1e-2]))[0]
    assert_allclose(low[:3, :3].real, one.mass[0, 0] * np.eye(3), rtol=0, atol=1e-4)


def test_a_shock_is_that_of_the_time_integration_of_a_driven_base(rod):
    system = on_ground(rod)
    seen = [Observed("tip", body="rod", interface="right", quantities=("acceleration", "displacement"))]
    model = shaken_system(system, bases_of_system(system, None), Damping(own=True), seen)
    t = np.linspace(0, 0.02, 201)
    a = 20.0 * np.sin(np.pi * t / 0.02)
    run = time_runs(model, TimeTest("s", t, a, ("z",), after=0.02))[0]
    table = ff.RigidBody("table", 1.0, np.eye(3))
    drive = acceleration_table(np.append(t, 0.1), np.append(a, 0.0))
    slide = ff.PrismaticJoint(
        "slide", ff.Marker(ff.GROUND), ff.Marker("table"), axis=(0, 0, 1), motions={"distance": drive}
    )
    foot = ff.FixedJoint("foot", ff.Marker("table"), ff.Marker("rod", "left"))
    driven = ff.System([ff.FlexibleBody("rod", rod, stiffening=False), table], [slide, foot])
    motion = ff.integrate(driven, ff.GeneralizedAlpha(rho_inf=0.9), t_end=0.04, h=2e-5, output_every=10)
    tip = ff.results.interface_motion(motion, "rod", rod, "right")
    names = [output.name for output in run.outputs]
    mine = run.values[names.index("tip displacement z")]
    base = motion.body("table").r[:, 2]
    theirs = tip.position[:, 2] - base
    error = np.abs(np.interp(motion.t, run.t, mine) - theirs).max()
    assert error < 1e-3 * np.abs(theirs).max()
    force = -motion.reaction("foot").force[:, 2]
    own = run.values[names.index("base force z")]
    assert np.abs(np.interp(motion.t, run.t, own) - force).max() < 2e-2 * np.abs(force).max()


def test_the_job_takes_a_system_and_its_sensors(rod):
    system = replace(on_ground(rod), sensors=[ff.sensors.ReactionSensor("load", "foot")])
    level = ff.durability.shaking.Level.of([(5, 1.0), (60, 1.0)])
    job = ff.durability.shaking.ShakeJob(
        system,
        damping=Damping(Q=20),
        outputs=[Observed("load", sensor="load")],
        sine=[ff.durability.shaking.SineTest("s", level, ("z",))],
    )
    run = ff.durability.shaking.shake(job).sine[0]
    names = [output.name for output in run.outputs]
    assert_allclose(run.sizes[:, names.index("load force z")], run.sizes[:, names.index("base force z")], rtol=1e-9)


@pytest.mark.parametrize(
    ("bases", "words"),
    [({"a": ("fot",)}, "foot"), ({"a": ("foot",), "b": ("foot",)}, "held by two bases")],
)
def test_bases_that_do_not_exist_are_refused(rod, bases, words):
    with pytest.raises(ModelError, match=words):
        bases_of_system(on_ground(rod), bases)


def test_what_stays_free_is_refused(rod):
    hinge = ff.RevoluteJoint("foot", ff.Marker(ff.GROUND), ff.Marker("rod", "left"), axis=(0, 0, 1))
    system = ff.System([ff.FlexibleBody("rod", rod)], [hinge])
    with pytest.raises(ModelError, match="1 motion with fixed bases without energy"):
        shaken_system(system, bases_of_system(system, None), Damping(ratio=0.02))
    with pytest.raises(ModelError, match="on the ground that could move it"):
        bases_of_system(ff.System([ff.FlexibleBody("rod", rod)]), None)


@pytest.mark.parametrize("frame", [cms.TisserandFrame(), cms.NodalFrame("tip"), cms.NodalFrame("foot")])
@pytest.mark.parametrize("held", [("foot",), ("foot", "tip")])
def test_recovery_rows_of_places_count_from_the_first_base(frame, held):
    """A body in a system, turned and away from the origin, has the rows that it has alone.

    Static residuals of its rows answer to what the base exerts, in a system without the damping of the modes: 2 zeta of
    a residual of some tenths of a per cent here.
    """
    mesh = fm.beams.straight_line((0.3, -0.2, 0.1), (0.3, 0.1, 0.9), 6)
    ends = [
        fm.beams.line_interface(mesh, n, fm.selections.NodeSet(at)) for n, at in (("foot", "start"), ("tip", "end"))
    ]
    section = fm.beams.BeamProperty(fm.beams.Rectangle(0.04, 0.03), fm.Material("al", E=70e9, nu=0.33, rho=2700.0))
    part = cms.couple(fm.beam_body(mesh, section, name="mast", units=cms.unit_system("m-kg-s"), interfaces=ends))
    motions = [cms.reduction.Rows(kind, ("tip", 3)) for kind in ("displacement", "velocity", "acceleration")]
    request = cms.reduction.RecoveryRequest("t", tuple(motions))
    body = cms.reduce(part, cms.craig_bampton(part, 6), frame=frame, recovery=request)
    turned = Rotation.from_rotvec([0.4, -0.7, 0.3])
    turn = turned.as_matrix()
    joints = [
        ff.FixedJoint(
            f"at {name}",
            ff.Marker(ff.GROUND, position=turn @ mesh.nodes[node] + [5.0, 1.0, -2.0], triad=turn),
            ff.Marker("mast", name),
        )
        for name, node in (("foot", 0), ("tip", 6)) if name in held
    ]  # fmt: skip
    sensor = ff.sensors.RecoverySensor("t", "mast", "t")
    standing = ff.FlexibleBody("mast", body, position=(5.0, 1.0, -2.0), orientation=np.roll(turned.as_quat(), 1))
    system = ff.System([standing], joints, [], units=body.units, sensors=[sensor])
    bases = {name: (f"at {name}",) for name in held}
    model = shaken_system(system, bases_of_system(system, bases), Damping(Q=25), [Observed("t", sensor="t")])
    alone = shaken_body(
        body, bases_of_body(body, {n: (n,) for n in held}), Damping(Q=25), [Observed("t", recovery="t")]
    )
    between = np.array([2.0, 60.0, 300.0])
    H, h = response(model, between), response(alone, between) @ np.kron(np.eye(2 * len(held)), turn.T)
    names = [output.name for output in alone.outputs]
    for k, output in enumerate(model.outputs):
        if output.name.startswith("t "):
            expected = h[:, names.index(output.name.removeprefix("t "))]
            assert output.kind == alone.outputs[names.index(output.name.removeprefix("t "))].kind
            assert_allclose(H[:, k], expected, rtol=0, atol=1e-4 * np.abs(expected).max() + 1e-13, err_msg=output.name)

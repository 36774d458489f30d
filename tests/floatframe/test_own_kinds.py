"""The joint and the force of CONTRIBUTING.md, from a package beside floatframe: all take them, or refuse them by name.

The pin in a slot moves as a planar joint of which one coordinate is held, the cord pulls as a spring
does.
"""

import inspect
import re
import sys
import types
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import floatframe as ff
from floatframe.integrators.registry import CLASSES
from floatframe.model.functions.time_functions import harmonic
from floatframe.model.joints import JOINTS
from floatframe.model.joints.joint import Column
from tests.floatframe.engine.tree.mechanisms import beam
from tests.root import ROOT

pytestmark = pytest.mark.filterwarnings("ignore:.*linear frames")
GRAVITY = ff.Gravity((0.0, -9.81, 0.0))
TIP, POST = ff.Marker("arm", position=(0.6, 0.1, 0.0)), ff.Marker(ff.GROUND, position=(1.9, -0.4, 0.3))
LENGTH, STIFFNESS = 0.5, 20.0
INCLINED = Rotation.from_rotvec((0.0, 0.0, 0.2)).as_matrix()
ANY_AXES = Rotation.from_rotvec((0.3, 0.8, -0.5)).as_matrix()
T_END, H = 0.1, 2e-3


@pytest.fixture(scope="module", autouse=True)
def own(tmp_path_factory):
    """Write the code of the page into a package, import it, and return the classes."""
    page = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    folder = tmp_path_factory.mktemp("own")
    package = folder / "slots_and_cords"
    package.mkdir()
    (package / "__init__.py").write_text('ELEMENTS = {"cord": "slots_and_cords.force:RubberCord"}\n')
    for name in ("joint", "force"):
        code = re.search(rf"<!-- own {name} -->\n```python\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)[1]
        (package / f"{name}.py").write_text(code)
    sys.path.insert(0, str(folder))
    try:
        from slots_and_cords.force import RubberCord
        from slots_and_cords.joint import PinInSlot

        KINDS.joint, KINDS.force = PinInSlot, RubberCord
        yield folder
    finally:
        sys.path.remove(str(folder))


KINDS = types.SimpleNamespace()
"""The classes of the page, when it has been read."""


def slot(on_rod, *, is_own, motions):
    """Return the pin in the slot, or the planar joint whose second coordinate is minus the distance along it.

    The slot is inclined, and the axis of the pin has another direction in the axes of marker B than in those of A.
    """
    ends = ff.Marker(ff.GROUND, position=(0.1, 0.0, 0.0), triad=INCLINED), replace(on_rod, triad=ANY_AXES)
    if is_own:
        return KINDS.joint("pin", *ends, motions=motions)
    names = {"distance": "second", "angle": "angle"}
    return ff.joints.PlanarJoint("pin", *ends, motions={"first": 0.0} | {names[name]: x for name, x in motions.items()})


def cord(*, is_own):
    """Return what a system has of the force, the own one or a spring, by the names of the fields of a system."""
    if is_own:
        return {"elements": [KINDS.force("cord", TIP, POST, LENGTH, STIFFNESS, 0.0)]}
    return {"forces": [ff.SpringDamper("cord", TIP, POST, stiffness=STIFFNESS, free_length=LENGTH)]}


def machine(*, is_own, has_force=True, is_flexible=False, motions=None):
    """Return a rod on the pin, with an arm on a hinge and a spring that pulls the rod along the slot."""
    rod = ff.RigidBody("rod", 2.0, np.diag([0.1, 0.2, 0.25]), position=(0.6, 0.0, 0.0))
    ends = [ff.Marker("rod", position=(x, 0.0, 0.0)) for x in (-0.5, 0.5)]
    if is_flexible:
        rod = ff.FlexibleBody("rod", beam(), position=(0.1, 0.0, 0.0))
        ends = [ff.Marker("rod", name) for name in ("start", "end")]
    arm = ff.RigidBody("arm", 1.0, np.diag([0.02, 0.05, 0.06]), position=(1.5, 0.0, 0.0))
    joints = [
        slot(ends[0], is_own=is_own, motions=motions or {}),
        ff.RevoluteJoint("hinge", ends[1], ff.Marker("arm", position=(-0.4, 0.0, 0.0))),
    ]
    spring = ff.SpringDamper("spring", ff.Marker(ff.GROUND), ends[0], stiffness=300.0, damping=2.0)
    both = cord(is_own=is_own) if has_force else {}
    forces = [GRAVITY, spring, *both.pop("forces", [])] if has_force else [GRAVITY]
    sensors = [ff.joints.JointCoordinate("pin", "angle", "angle"), ff.sensors.PlaceSensor("tip", TIP)]
    return ff.System([rod, arm], joints, forces, sensors=sensors, **both)


# schemes --------------------------------------------------------------------------------------------------------------

SCHEMES = {
    "GeneralizedAlpha": ff.GeneralizedAlpha(0.9, 1e-12),
    "RelativeGeneralizedAlpha": ff.integrators.RelativeGeneralizedAlpha(0.9, 1e-12),
    "RelativeOde": ff.integrators.RelativeOde("BDF", 1e-9, 1e-11),
    "EnergyMomentum": ff.integrators.EnergyMomentum(),
    "EnergyDecaying": ff.integrators.EnergyDecaying(0.5),
    "Variational": ff.integrators.Variational(),
    "Ida": ff.integrators.Ida(1e-6, 1e-8),
}
EXACT = 1e-8  #: of lengths of 1
CLOSE = {"RelativeOde": 1e-6, "Ida": 1e-6}  #: schemes that control their error take other steps


def test_every_scheme_is_asked():
    assert set(SCHEMES) == set(CLASSES)


@pytest.mark.parametrize(
    ("scheme", "is_flexible"),
    [(name, False) for name in SCHEMES] + [(name, True) for name in SCHEMES if name not in CLOSE],
)
def test_every_scheme_moves_them_as_those_of_floatframe(scheme, is_flexible):
    if scheme == "Ida":
        pytest.importorskip("sksundae", reason="the extra 'ida' is not installed")
    motions = [
        ff.integrate(machine(is_own=is_own, is_flexible=is_flexible), SCHEMES[scheme], T_END, H, watch="off")
        for is_own in (True, False)
    ]
    tolerance = CLOSE.get(scheme, EXACT)
    for body in ("rod", "arm"):
        found, expected = (motion.body(body) for motion in motions)
        assert np.abs(expected.r - expected.r[0]).max() > 1e-3
        assert_allclose(found.r, expected.r, rtol=0, atol=tolerance)
        assert_allclose(found.p, expected.p, rtol=0, atol=tolerance)
    force, expected = (motion.reaction("pin").force for motion in motions)
    assert_allclose(force[1:], expected[1:], rtol=0, atol=1e3 * tolerance * np.abs(expected).max())


# analyses -------------------------------------------------------------------------------------------------------------


def run(system, formulation="absolute", **options):
    """Return a short motion."""
    return ff.integrate(system, ff.GeneralizedAlpha(0.9, 1e-12), T_END, H, formulation=formulation, **options)


def small(system, formulation="absolute"):
    """Return the equilibrium, and the system linearised about it: a torque along the pin goes in, the tip comes out."""
    about = ff.static_equilibrium(system, formulation=formulation)
    inputs = [ff.joints.JointCoordinate("pin", "angle", "torque", rate=0)]
    outputs = [ff.sensors.Channel("tip", TIP, (0, 1, 0)), ff.joints.JointCoordinate("pin", "angle", "rate", rate=1)]
    return about, ff.linearize(system, about, inputs=inputs, outputs=outputs, formulation=formulation)


def magnitudes(found):
    """Return the magnitudes of eigenvalues in order, without those of motions that cost nothing."""
    return np.sort(np.abs(found[np.abs(found) > 1e-3]))


def modes(system, folder, formulation):
    """Return the eigenvalues about the equilibrium."""
    return magnitudes(ff.system_modes(small(system, formulation)[1]).eigenvalues)


def response(system, folder, formulation):
    """Return the responses of tip and rate to the torque."""
    linear = small(system, formulation)[1]
    frequencies = ff.analyses.resolved_frequencies(linear, 0.5, 3.0)[:3]
    return np.abs(ff.frequency_response(linear, frequencies).values)


def state_space(system, folder):
    """Return the gain at rest of the written state space."""
    linear = small(system)[1]
    ff.analyses.write_state_space(linear, folder / "linear.npz")
    space = ff.analyses.named_state_space(linear)
    return (space.C @ np.linalg.solve(1j * np.eye(len(space.A)) - space.A, space.B)).view(float)


def steady_motion(system, folder):
    """Return where the machine rests, as a steady motion at the speed zero from its equilibrium on."""
    at_rest = ff.static_equilibrium(system).state
    return ff.analyses.steady_motion(system, "arm", 0.0, state=at_rest).equilibrium.state.r


def locus(system, folder):
    """Return eigenvalues over a parameter that changes nothing."""
    return magnitudes(ff.analyses.root_locus(lambda _: small(system)[1], [0.0, 1.0]).eigenvalues)


def sensitivities(system, folder):
    """Return the derivatives of the tip by a mass and a stiffness."""
    parameters = ["bodies.rod.mass", "forces.spring.stiffness"]
    return ff.design.sensitivities(system, ["tip y"], parameters, t_end=T_END, h=H).gradient


def results(system, folder, formulation):
    """Return coordinates and sensors of a motion that is written and read."""
    path = folder / f"{formulation}.h5"
    motion = run(system, formulation, output=path)
    assert_allclose(ff.read_results(path).body("arm").r, motion.body("arm").r, rtol=0, atol=0)
    angle = ff.joints.JointCoordinate("pin", "angle").measure(system, motion)
    assert_allclose(motion.joint("pin").angle, angle.value, rtol=0, atol=0)
    assert_allclose(motion.sensor("angle")["value"], angle.value, rtol=0, atol=0)
    ff.results.motion_table(motion, system=system).write(folder / "motion.csv")
    tip = ff.sensors.measured(system, motion)["tip"]
    return np.column_stack([angle.value, angle.rate, tip["y"], motion.energies.total])


def resumed(system, folder):
    """Return the places of a motion that is interrupted and resumed."""

    def interrupted(progress):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(system, output=folder / "run.h5", progress=interrupted, batch_steps=20)
    return ff.simulation.resume(system, folder / "run.h5").body("arm").r


def outputs(system, folder):
    """Return what sensors would measure in an identification."""
    found = ff.design.identification.computed_outputs(system, np.linspace(0.0, T_END, 11), ["tip y", "pin.angle value"])
    return np.array(list(found.values.values()))


def inverse_kinematics(system, folder):
    """Return the place of the arm at which the tip is where it should be."""
    return ff.analyses.inverse_kinematics(system, ff.analyses.Target(TIP, position=(1.6, 0.3, 0.0))).state.r[1]


def open_equations(system, folder):
    """Return accelerations and energy of the open equations in a motion."""
    equations = ff.analyses.open_equations(system)
    x, v = equations.vectors(run(system).state(-1))
    return np.append(equations.accelerations(T_END, x, v)[0], equations.energy(x, v))


def pictures(system, folder):
    """Return how many pages and pictures are drawn."""
    about, linear = small(system)
    found = ff.system_modes(linear)
    ff.view(run(system), folder / "motion.html", system=system)
    ff.pictures.view_modes(system, about, found, folder / "modes.html")
    ff.pictures.draw_mode(system, about, found, 1, folder / "mode.png")
    ff.analyses.snapshot(system, about)
    return len(list(folder.iterdir()))


#: analyses that take both: numbers of one system, by the functions of floatframe that they try
BOTH = {
    "static_equilibrium": lambda system, _: ff.static_equilibrium(system).state.r,
    "static_equilibrium in joint coordinates": lambda system, _: (
        ff.static_equilibrium(system, formulation="relative").state.r
    ),
    "linearize system_modes": lambda system, folder: modes(system, folder, "absolute"),
    "linearize system_modes in joint coordinates": lambda system, folder: modes(system, folder, "relative"),
    "frequency_response": lambda system, folder: response(system, folder, "absolute"),
    "frequency_response in joint coordinates": lambda system, folder: response(system, folder, "relative"),
    "named_state_space write_state_space": state_space,
    "root_locus": locus,
    "campbell": lambda system, _: magnitudes(ff.analyses.campbell(system, [0.0]).eigenvalues),
    "steady_motion": steady_motion,
    "steady_rotation": lambda system, _: ff.analyses.steady_rotation(system, (0.0, 0.0, 0.0)).state.r,
    "sensitivities": sensitivities,
    "mobility": lambda system, _: ff.analyses.mobility(system).n_freedoms,
    "consistent_state": lambda system, _: ff.analyses.consistent_state(system).state.u,
    "integrate read_results JointCoordinate": lambda *given: results(*given, "absolute"),
    "integrate in joint coordinates": lambda *given: results(*given, "relative"),
    "resume": resumed,
    "computed_outputs": outputs,
    "inverse_kinematics": inverse_kinematics,
    "open_equations": open_equations,
    "draw_mode view view_modes snapshot": pictures,
}


@pytest.mark.parametrize("analysis", BOTH)
def test_every_analysis_takes_them_as_those_of_floatframe(analysis, tmp_path):
    found, expected = (BOTH[analysis](machine(is_own=is_own), made(tmp_path, is_own)) for is_own in (True, False))
    assert_allclose(found, expected, rtol=0, atol=1e-7 * np.abs(expected).max())


def made(folder, name):
    """Return a new folder."""
    path = folder / str(name)
    path.mkdir()
    return path


def crank(*, is_own):
    """Return the machine with a driven pin and a fixed hinge."""
    system = machine(is_own=is_own, motions={"angle": harmonic(0.3, 2.0), "distance": 0.0})
    hinge = replace(system.joints[1], motions={"angle": 0.0})
    return replace(system, joints=[system.joints[0], hinge])


def driven(system, folder):
    """Return places of a kinematic analysis, forces of the drives, and places of the motion with motors in place."""
    times = np.linspace(0.0, T_END, 11)
    moved = ff.kinematics(system, times)
    inverse = ff.inverse_dynamics(system, times)
    motion = run(system)
    drives = ff.analyses.drive_forces(system, motion)
    force = inverse.drives["pin.angle"].force
    assert_allclose(drives["pin.angle"].force[::5], force, rtol=0, atol=1e-2 * np.abs(force).max())
    freed = run(ff.analyses.with_motors(system, {"pin.angle": drives["pin.angle"]}))
    return np.concatenate([moved.body("arm").r.ravel(), force, freed.body("arm").r.ravel()])


def test_drives_of_the_joint_move_as_those_of_floatframe(tmp_path):
    """A crank on the pin: its motion by kinematics, its torque by inverse dynamics, and back."""
    found, expected = (driven(crank(is_own=is_own), tmp_path) for is_own in (True, False))
    assert_allclose(found, expected, rtol=0, atol=1e-7 * np.abs(expected).max())


def test_the_law_of_the_cord_is_found_good_and_its_energy_is_that_of_its_force():
    """Stiffening too: what the energy-momentum scheme keeps to rounding is the energy that the law names."""
    system = machine(is_own=True)
    force = replace(system.elements[0], stiffening=300.0)
    system = replace(system, elements=[force], forces=[GRAVITY])
    assert ff.analyses.check_element(system, "cord").findings == ()
    motion = ff.integrate(system, ff.integrators.EnergyMomentum(), T_END, H, watch="off")
    seen = ff.results.element_motion(system, motion, "cord")
    e = seen.outputs["elongation"]
    assert_allclose(seen.wrench[:, 1, :3], -seen.wrench[:, 0, :3], rtol=0, atol=1e-12)
    assert_allclose(np.linalg.norm(seen.wrench[:, 0, :3], axis=1), STIFFNESS * e + 300.0 * e**3, rtol=1e-12)
    total = motion.energies.total
    assert_allclose(total, total[0], rtol=0, atol=1e-10 * np.ptp(motion.energies.kinetic))


# recursions, generated code and identification: the joint without the cord, which they do not take --------------------


def compared(columns):
    """Return numbers by columns of the planar joint as those of the pin: without `first`, minus `second`."""
    return np.concatenate([-columns[..., 1:2], columns[..., 2:]], axis=-1)


def test_recursions_of_the_joint_are_those_of_floatframe():
    own, planar = (ff.analyses.relative_model(machine(is_own=is_own, has_force=False)) for is_own in (True, False))
    z, z_dot, z_ddot = np.random.default_rng(1).normal(size=(3, 3))
    motion = [np.array([0.0, -x[0], x[1], x[2]]) for x in (z, z_dot, z_ddot)]
    force = own.inverse_dynamics(z, z_dot, z_ddot)
    assert_allclose(force, compared(planar.inverse_dynamics(*motion)), rtol=0, atol=1e-12 * np.abs(force).max())
    for found, expected in zip(own.derivatives(z, z_dot, z_ddot), planar.derivatives(*motion), strict=True):
        assert_allclose(found, compared(compared(expected).T).T, rtol=0, atol=1e-11)
    assert_allclose(own.forward_dynamics(z, z_dot, force), z_ddot, rtol=0, atol=1e-11)
    assert own.rate_names == ("pin/distance", "pin/angle", "hinge/angle")


def test_generated_code_and_linear_forms_of_the_joint_are_its_recursions(tmp_path):
    system = machine(is_own=True, has_force=False)
    motion = np.random.default_rng(2).normal(size=(3, 3))
    force = ff.analyses.relative_model(system).inverse_dynamics(*motion)
    code = ff.design.generate(system, language="python", name="generated").files["generated.py"]
    space = {}
    exec(code, space)
    assert_allclose(space["generated"](*motion), force, rtol=0, atol=1e-12 * np.abs(force).max())
    form = ff.design.identification.linear_form(system)
    samples = ff.design.identification.tree_samples(system, *motion[:, None])
    assert_allclose(form.torques(samples)[0] @ form.values, force, rtol=0, atol=1e-12 * np.abs(force).max())
    unit = ff.design.generate_fmu(system, tmp_path / "pin.fmu")
    assert "pin.distance.value" in {each.name for each in unit.variables}


# system files ---------------------------------------------------------------------------------------------------------

SYSTEM = """
[system]
units = "m-kg-s"
gravity = [0, -9.81, 0]

[bodies.rod]
mass = 2.0
inertia = [[0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.25]]
position = [0.6, 0, 0]

[joints.pin]
type = "slots.pin-in-slot"
body_a = "ground"
marker_a = [0.1, 0, 0]
body_b = "rod"
marker_b = [-0.5, 0, 0]
axis = [0, 0, 1]
slot = [1, 0, 0]

[joints.pin.motions.angle]
type = "constant"
value = 0.25

[elements.cord]
type = "slots_and_cords.cord"
marker_a = {body = "rod", marker = [0.5, 0, 0]}
marker_b = {body = "ground", marker = [1.9, -0.4, 0.3]}
length = 0.5
stiffness = 20
stiffening = 300
"""


def test_a_system_file_gives_them_the_keys_of_their_fields(tmp_path, monkeypatch):
    monkeypatch.setitem(JOINTS, "slots.pin-in-slot", KINDS.joint)
    (tmp_path / "slot.toml").write_text(SYSTEM)
    system, _ = ff.read_system(tmp_path / "slot.toml")
    (pin,), (force,) = system.joints, system.elements
    assert type(pin) is KINDS.joint
    assert_allclose([pin.marker_a.position, pin.marker_b.position], [(0.1, 0, 0), (-0.5, 0, 0)], rtol=0, atol=0)
    assert_allclose([pin.axis, pin.slot], [(0, 0, 1), (1, 0, 0)], rtol=0, atol=0)
    assert pin.motions["angle"](0.3) == 0.25
    assert (type(force), force.length, force.stiffness, force.stiffening) == (KINDS.force, 0.5, 20.0, 300.0)


@pytest.mark.parametrize(("old", "new", "words"), [
    ("slots.pin-in-slot", "slots.pin-in-slt", r"unknown type of joint; did you mean 'slots.pin-in-slot.* \(line 12\)"),
    ("slot = [1, 0, 0]", "slto = [1, 0, 0]", "pin.slto: unknown key of type .slots.pin-in-slot.; did you mean 'slot'"),
    ("slot = [1, 0, 0]\n", "", r"pin.slot: missing; expected a list of numbers \(line 11\)"),
    ("motions.angle", "motions.angel", r"pin.motions: no coordinate 'angel'; choices: distance, angle \(line 11\)"),
    ("stiffness = 20", 'stiffness = "20"', r"cord.stiffness = .20.: expected a number: k \(line 29\)"),
    ("length = 0.5", "lenght = 0.5", "cord.lenght: unknown key; did you mean 'length'"),
])  # fmt: skip
def test_mistakes_in_a_system_file_are_told_with_key_and_line(tmp_path, monkeypatch, old, new, words):
    monkeypatch.setitem(JOINTS, "slots.pin-in-slot", KINDS.joint)
    (tmp_path / "slot.toml").write_text(SYSTEM.replace(old, new, 1))
    with pytest.raises(ff.errors.SystemFileError, match=words):
        ff.read_system(tmp_path / "slot.toml")


# refusals -------------------------------------------------------------------------------------------------------------


def cord_alone():
    """Return the machine without the spring."""
    system = machine(is_own=True)
    return replace(system, forces=[GRAVITY])


class NoRows(ff.model.joints.Joint):
    """A joint that has forgotten its rows."""


def with_columns(*names):
    """Return the machine with a pin that has only the columns of these names, or another one too."""
    pin = machine(is_own=True).joints[0]

    def columns(self, A_a, A_b):
        found = {column.name: column for column in super(kind, self).columns(A_a, A_b)}
        return tuple(found.get(name, Column(name, tau=self.axis, unit="m")) for name in names)

    kind = type("WrongColumns", (type(pin),), {"columns": columns})
    system = machine(is_own=True, has_force=False)
    return replace(system, joints=[kind("pin", pin.marker_a, pin.marker_b), system.joints[1]])


REFUSALS = {
    "relative_model": (lambda _: ff.analyses.relative_model(cord_alone()), "element 'cord'"),
    "generate": (lambda _: ff.design.generate(cord_alone()), "element 'cord'"),
    "generate_fmu": (lambda folder: ff.design.generate_fmu(cord_alone(), folder / "cord.fmu"), "element 'cord'"),
    "robot_of_system": (lambda _: ff.files.robot_of_system(machine(is_own=True, has_force=False)), "joint 'pin'"),
    "no joint": (lambda _: ff.System([ff.RigidBody("b", 1.0, np.eye(3))], [object()]), "expected .* a Joint"),
    "a column too few": (
        lambda _: ff.analyses.relative_model(with_columns("angle")),
        r"joint 'pin': columns: expected 2, because its rows are 4 constraints, got 1 \(angle\)",
    ),
    "a column too many": (
        lambda _: ff.static_equilibrium(with_columns("distance", "angle", "up"), formulation="relative"),
        r"got 3 \(distance, angle, up\)",
    ),
    "no rows": (lambda _: NoRows().rows(None, None, None), "NoRows: expected a method rows"),
}


@pytest.mark.parametrize("what", REFUSALS)
def test_what_does_not_take_them_says_so_by_name(what, tmp_path):
    refused, words = REFUSALS[what]
    with pytest.raises(ff.errors.FloatframeError, match=words):
        refused(tmp_path)


#: functions of a system that concern other parts of it, or do the same as one that is tried
OTHER = {
    "animate_mode": "a film of draw_mode", "co_simulate": "units of other programs", "coupler_motion": "couplers",
    "study": "descriptions of a flexible body", "user_force_motion": "user forces",
}  # fmt: skip


def test_every_function_of_a_system_is_tried():
    source = inspect.getsource(sys.modules[__name__])
    for name in dir(ff):
        function = getattr(ff, name)
        if inspect.isfunction(function) and {"system", "linear"} & set(inspect.signature(function).parameters):
            assert (f"ff.{name}(" in source) != (name in OTHER), name

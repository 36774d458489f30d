"""How far bodies may turn in a step of generalized-alpha, stabilised (velocities held, spins by themselves) and plain.

    python -m benchmarks.turning_step [--flexible]

An arm on a hinge, its frame away from it: least steps per turn with which its speed is off by at most 1 % after ten
turns. A gyroscope whose weight is carried beside its suspension: largest spin in a step with which it precesses by
m g l/(J w) to 1 %.

With --flexible: rotors on flexible shafts, in both formulations. A disc at the end of a shaft on a ball joint
precesses, and a disc between two shafts whirls; both rates over those of steps of 0.0125 rad in absolute coordinates.
"""

import sys

import numpy as np

import cms
import fe_models as fm
from floatframe import (
    GROUND,
    FixedJoint,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    System,
    integrate,
)
from floatframe.errors import FloatframeError
from floatframe.joints import PointOnLine, UniversalJoint

ALLOWED = 0.01
STEPS_PER_TURN = (7, 8, 10, 12, 16, 20, 30, 40, 60, 80, 120, 160, 240, 320, 480, 640)
SPINS = (5.0, 2.0, 1.0, 0.5, 0.4, 0.3, 0.2, 0.1, 0.05, 0.02)
RHO = (1.0, 0.95, 0.9, 0.8, 0.5)


def at(body, x=0.0):
    return Marker(body, position=np.array([x, 0.0, 0.0]))


def arm_error(method, n_steps):
    """Return by how much the speed of the arm is off after ten turns of n_steps each."""
    body = RigidBody("arm", 1.0, 0.01 * np.eye(3), position=(1, 0, 0), velocity=(0, 10, 0), omega_B=(0, 0, 10))
    system = System([body], [RevoluteJoint("hinge", GROUND, at("arm", -1.0), axis=(0, 0, 1))])
    turn = 2 * np.pi / 10.0
    try:
        motion = integrate(system, method, 10 * turn, turn / n_steps, watch="off")
    except FloatframeError:
        return np.inf
    return np.abs(motion.body("arm").omega_B[:, 2] / 10.0 - 1).max()


def gyroscope_error(method, spin_of_step):
    """Return by how much the precession of the gyroscope is off."""
    J, arm, w = 0.02, 0.3, 200.0
    rate = 9.81 * arm / (J * w)
    frame = RigidBody("frame", 0.01, 1e-4 * np.eye(3), omega_B=(0, 0, rate))
    rotor = RigidBody(
        "rotor", 1.0, np.diag([J, 0.012, 0.012]), position=(arm, 0, 0), velocity=(0, rate * arm, 0),
        omega_B=(w, 0, rate),
    )  # fmt: skip
    joints = [
        UniversalJoint("gimbal", GROUND, at("frame"), axis=(0, 0, 1), axis_b=(0, 1, 0)),
        RevoluteJoint("hinge", at("frame", arm), at("rotor"), axis=(1, 0, 0)),
    ]
    system = System([frame, rotor], joints, [Gravity((0, 0, -9.81))])
    try:
        motion = integrate(system, method, 2.0, spin_of_step / w, watch="off")
    except FloatframeError:
        return np.inf
    r = motion.body("rotor").r
    return abs(np.unwrap(np.arctan2(r[:, 1], r[:, 0]))[-1] / (rate * motion.t[-1]) - 1)


def shaft(diameter):
    """Return a steel shaft of 0.3 m, of six beam elements and four modes."""
    mesh = fm.beams.straight_line((0, 0, 0), (0.3, 0, 0), 6)
    ends = [fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in (("left", 0), ("right", 6))]
    section = fm.beams.BeamProperty(fm.beams.Circle(diameter / 2), fm.Material("steel", E=2.1e11, nu=0.3, rho=7850.0))
    body = fm.beam_body(mesh, section, name="shaft", units=cms.unit_system("m-kg-s"), interfaces=ends)
    coupled = cms.couple(body)
    return cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=4))


def precession(formulation, turn):
    """Return the precession of a disc on a flexible shaft, 200 rad/s, and whether the run reports an error."""
    J, arm, w = 0.02, 0.3, 200.0
    rate = 9.81 * arm / (J * w)
    bodies = [
        FlexibleBody("shaft", shaft(0.01), omega_B=(w, 0, rate)),
        RigidBody(
            "disc", 1.0, np.diag([J, 0.012, 0.012]), position=(arm, 0, 0), velocity=(0, rate * arm, 0),
            omega_B=(w, 0, rate),
        ),
    ]  # fmt: skip
    joints = [SphericalJoint("pin", GROUND, Marker("shaft", "left")),
              FixedJoint("hub", Marker("shaft", "right"), Marker("disc"))]  # fmt: skip
    system = System(bodies, joints, [Gravity((0, 0, -9.81))])
    motion = integrate(system, GeneralizedAlpha(0.8), 1.0, turn / w, formulation=formulation, watch="tell")
    r = motion.body("disc").r
    rate = np.unwrap(np.arctan2(r[:, 1], r[:, 0]))[-1] / motion.t[-1]
    return np.array([rate]), any(note.kind == "steps" for note in motion.validity)


def whirls(formulation, turn):
    """Return backward and forward whirl of a disc between two shafts, 1000 rad/s, and whether the run reports an error.

    y + i z of the disc is a sum of two exponentials: their rates are those of the map from one sample to the next, in
    the space of the two largest singular vectors of delayed samples.
    """
    w, half, step = 1000.0, shaft(0.006), turn / 1000.0
    bodies = [FlexibleBody(name, half, position=(x, 0, 0), omega_B=(w, 0, 0)) for name, x in (("a", 0.0), ("b", 0.3))]
    inertia = 1e-4 * np.diag([5, 3, 3])
    bodies += [RigidBody("disc", 1.0, inertia, position=(0.3, 0, 0), velocity=(0, 0.05, 0), omega_B=(w, 0, 0))]
    joints = [
        SphericalJoint("pin", GROUND, Marker("a", "left")),
        FixedJoint("hub", Marker("a", "right"), Marker("disc")),
        FixedJoint("other", Marker("disc"), Marker("b", "left")),
        PointOnLine("end", at("ground", 0.6), Marker("b", "right"), axis=(1, 0, 0)),
    ]
    motion = integrate(System(bodies, joints), GeneralizedAlpha(0.8), 0.24, step, formulation=formulation, watch="tell")
    every = max(1, round(0.01 / step))
    z = (motion.body("disc").r[:, 1:] @ [1, 1j])[::every]
    delayed = np.lib.stride_tricks.sliding_window_view(z, len(z) // 2)
    V = np.linalg.svd(delayed, full_matrices=False)[2][:2]
    factors = np.linalg.eigvals(np.linalg.lstsq(V[:, :-1].T, V[:, 1:].T, rcond=None)[0])
    return np.sort(np.angle(factors)) / (every * step), any(note.kind == "steps" for note in motion.validity)


def flexible_rotors():
    """Print the table of rotors on flexible shafts; a star: the run reports the error of its steps."""
    turns = (0.1, 0.2, 0.4, 1.0, 2.0)
    print("| rad a step | " + " | ".join(f"{turn:g}" for turn in turns) + " |")
    for name, rates in (("precession", precession), ("whirl, backwards and forwards", whirls)):
        exact, _ = rates("absolute", 0.0125)
        for formulation in ("absolute", "relative"):
            cells = []
            for turn in turns:
                try:
                    found, is_reported = rates(formulation, turn)
                    cells.append(", ".join(f"{each:.3f}" for each in found / exact) + " *" * is_reported)
                except FloatframeError:
                    cells.append("fails")
            print(f"| {name}, {formulation} | {' | '.join(cells)} |", flush=True)


def first_within(error, choices):
    """Return the first choice from which on all errors are allowed, as a word."""
    best = None
    for choice in reversed(choices):
        if not error(choice) <= ALLOWED:
            break
        best = choice
    return "none" if best is None else f"{best:g}"


def main():
    print("| rho_inf | arm: steps a turn, plain | arm, stabilised | gyroscope: rad a step, plain | stabilised |")
    print("|---|---|---|---|---|")
    for rho in RHO:
        plain, stabilized = GeneralizedAlpha(rho, stabilized=False), GeneralizedAlpha(rho)
        cells = [
            first_within(lambda choice, m=m, e=e: e(m, choice), choices)
            for e, choices in ((arm_error, STEPS_PER_TURN), (gyroscope_error, SPINS))
            for m in (plain, stabilized)
        ]
        print(f"| {rho:g} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    flexible_rotors() if "--flexible" in sys.argv[1:] else main()

"""How far bodies may turn in a step of generalized-alpha, stabilised (velocities held, spins by themselves) and plain.

    python -m benchmarks.turning_step

An arm on a hinge, its frame away from it: least steps per turn with which its speed is off by at most 1 % after ten
turns. A gyroscope whose weight is carried beside its suspension: largest spin in a step with which it precesses by
m g l/(J w) to 1 %.
"""

import numpy as np

from floatframe import (
    GROUND,
    FloatframeError,
    GeneralizedAlpha,
    Gravity,
    Marker,
    RevoluteJoint,
    RigidBody,
    System,
    UniversalJoint,
    integrate,
)

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
    main()

"""Play, bearings, friction and tyres in closed form, from the text of their classes."""

from math import atan, exp, hypot, pi, sqrt

import numpy as np
from scipy.spatial.transform import Rotation

from floatframe.components.bearings import Bearing
from floatframe.components.clearances import Backlash, BallWithPlay, HingeWithPlay
from floatframe.components.friction import BristleFriction
from floatframe.components.wheels import BrushTyre, LinearTyre
from floatframe.components.wheels.roads.road import FlatRoad, Grip
from tests.floatframe.element_laws import marker_motion
from tests.floatframe.laws.form import AXIS, A, B, Form, Pair, State, pair

__all__ = ["FORMS", "rolling"]

START = pair(100)
NORMAL = np.cross(AXIS, [0.0, 0.0, 1.0]) / np.linalg.norm(AXIS[:2])  #: a direction across the axis, axes of a


def pressed(depth, rate, k, n, chi):
    """Return N, what of it the spring gives, and its energy."""
    if depth <= 0:
        return 0.0, 0.0, 0.0
    spring = k * depth**n
    return max(spring * (1 + chi * rate), 0.0), spring, spring * depth / (n + 1)


def backlash(motion):
    """Return a dead band between its stops, at each of them, and where a stop would pull."""
    lower, upper, k, n, chi = -0.2, 0.31, 2e4, 1.4, 0.15
    element = Backlash("b", A, B, lower, upper, k, n, chi, motion, AXIS)
    is_turn = motion == "about"

    def closed(state):
        two = Pair(state.x)
        way = state.z["way"]
        speed = two.turning if is_turn else two.sliding
        side, end = (1, upper) if way > (lower + upper) / 2 else (-1, lower)
        N, spring, energy = pressed(side * (way - end), side * speed, k, n, chi)
        seen = {"way": way, "force": side * N, "energy": energy, "power lost": (N - spring) * side * speed}
        return (two.torque if is_turn else two.force)(-side * N), {}, seen

    states = []
    for seed, way, speed in ((1, 0.1, 0.3), (2, 0.4, 0.6), (3, -0.35, 0.4), (4, 0.34, -0.9), (5, 0.33, -40.0)):
        x = pair(seed, offset=0.1 * NORMAL + way * AXIS, relative=0.2 * NORMAL + speed * AXIS, start=START,
                 angle=way if is_turn else 0.0)  # fmt: skip
        if is_turn:
            x[1, 15:] = x[0, 15:] + speed * Pair(x).e
        states.append(State(x, {"way": way}))
    normals = (
        {5: "about, as any number above 0"}
        if is_turn
        else {9 + k: "normals: for an angle alone" for k in range(6) if k > 2 or AXIS_NORMAL[k]}
    )
    return Form(element, START, tuple(states), closed, normals)


AXIS_NORMAL = np.cross(AXIS, np.eye(3)[int(np.argmin(np.abs(AXIS)))])
CONTACT = {"stiffness": 3e5, "exponent": 1.3, "damping": 0.2, "friction": 0.25, "friction_speed": 0.3, "radius": 0.02}


def contact(two, p, u, way, play):
    """Return wrenches, energy, lost power and normal force of a pin at p, in the direction u from its middle."""
    k, n, chi, mu, slow, r = CONTACT.values()
    q = p + r * u

    def velocity(m):
        return two.x[m, 12:15] + np.cross(two.x[m, 15:], q - two.x[m, :3])

    V = velocity(1) - velocity(0)
    rate = V @ u
    slip = V - rate * u
    N, spring, energy = pressed(way - play, rate, k, n, chi)
    rubbing = mu * N * slip / sqrt(slip @ slip + slow**2)
    return two.force_at(-N * u - rubbing, q), energy, (N - spring) * rate + rubbing @ slip, N


def ball():
    """Return a ball in a socket with play: free, pressed and leaving."""
    play = 0.01
    element = BallWithPlay("b", A, B, play, **CONTACT)

    def closed(state):
        two = Pair(state.x)
        way = np.linalg.norm(two.line)
        wrench, energy, lost, N = contact(two, state.x[1, :3], two.line / way, way, play)
        return wrench, {}, {"eccentricity": way, "force": N, "energy": energy, "power lost": lost}

    places = np.array([[0.004, 0.003, -0.002], [0.01, -0.004, 0.006], [-0.008, 0.01, 0.002], [0.003, 0.012, 0.009]])
    return Form(element, START, tuple(State(pair(seed, offset=p)) for seed, p in enumerate(places)), closed)


def hinge(slides, length=0.3):
    """Return a pin in a bearing with play in two planes, and along the axis unless it slides."""
    play, axial_play, axial_k, k_t, d_t, free = 0.01, 0.015, 4e5, 30.0, 0.7, 0.2
    element = HingeWithPlay("h", A, B, play, length=length, axial_play=axial_play, slides=slides,
                            axial_stiffness=axial_k, turn_stiffness=k_t, turn_damping=d_t, turn_free=free, axis=AXIS,
                            **CONTACT)  # fmt: skip

    def closed(state):
        two, turn = Pair(state.x), state.z["turn"]
        A_a0, A_b0 = Pair(START).axes
        pin = two.axes[1] @ A_b0.T @ A_a0 @ AXIS
        wrench, energy, lost, touching = np.zeros((2, 6)), 0.0, 0.0, 0
        for s in (-length / 2, length / 2) if length else (0.0,):
            p = state.x[1, :3] + s * pin
            d = p - state.x[0, :3]
            out = d - (d @ two.e) * two.e
            way = np.linalg.norm(out)
            if way > play:
                more, held, gone, N = contact(two, p, out / way, way, play)
                wrench, energy, lost, touching = wrench + more, energy + held, lost + gone, touching + (N > 0)
        if not slides:
            side = np.sign(two.way)
            N, spring, held = pressed(abs(two.way) - axial_play, side * two.sliding, axial_k, CONTACT["exponent"],
                                      CONTACT["damping"])  # fmt: skip
            wrench += two.force(-side * N)
            energy, lost = energy + held, lost + (N - spring) * side * two.sliding
        in_bearing = np.linalg.norm(wrench[1, :3])
        wrench += two.torque(-k_t * (turn - free) - d_t * two.turning)
        energy, lost = energy + 0.5 * k_t * (turn - free) ** 2, lost + d_t * two.turning**2
        off = two.line - two.way * two.e
        seen = {"angle": turn, "eccentricity": np.linalg.norm(off), "axial": two.way, "force": in_bearing,
                "contacts": touching, "energy": energy, "power lost": lost}  # fmt: skip
        seen["tilt"] = atan(np.linalg.norm(np.cross(two.e, pin)) / abs(two.e @ pin))
        return wrench, {}, seen

    states = []
    for seed, offset, along, lean in (
        (1, 0.014, 0.004, 0.01),
        (2, 0.02, 0.021, 0.02),
        (3, 0.0125, -0.03, -0.01),
        (4, 0.002, 0.002, 0.03),
        (5, 0.003, 0.001, 0.12),
    ):  # the last touches at one end of the bearing
        x = pair(seed, offset=offset * NORMAL + along * AXIS, start=START, angle=0.3)
        A_a, A_b = Pair(x).axes
        x[1, 3:12] = (Rotation.from_rotvec(A_a @ (lean * NORMAL)).as_matrix() @ A_b).ravel()
        Q = A_a.T @ Pair(x).axes[1] @ Pair(START).axes[1].T @ Pair(START).axes[0]
        u = AXIS_NORMAL / np.linalg.norm(AXIS_NORMAL)
        turn = float(np.arctan2(np.cross(AXIS, u) @ Q @ u, u @ Q @ u))  # what the normal of the axis shows
        assert abs(turn - 0.3) < 0.01
        states.append(State(x, {"turn": turn}))
    silent = {}
    if slides:
        silent = {8: "nothing acts along the axis", 9: "the same", 10: "the same", 11: "any number below 0"}
    return Form(element, START, tuple(states), closed, silent)


def bearing():
    """Return a bearing with all its coefficients, and the axis of the shaft elsewhere in its marker."""
    K, D = np.array([[2e4, 3e3], [-5e3, 1.4e4]]), np.array([[70.0, 11.0], [6.0, 50.0]])
    k_a, d_a, k_t, d_t = 9e3, 40.0, 600.0, 3.0
    X = 0.8 * NORMAL + 0.6 * np.cross(AXIS, NORMAL)
    shaft = Pair(START).axes[1].T @ Pair(START).axes[0] @ AXIS
    element = Bearing("b", A, B, K, D, k_a, d_a, k_t, d_t, AXIS, X + 0.3 * AXIS, shaft)
    C = np.column_stack([X, np.cross(AXIS, X), AXIS])

    def closed(state):
        two = Pair(state.x)
        axes = two.axes[0] @ C
        d = axes.T @ two.line
        d_dot = axes.T @ (state.x[1, 12:15] - state.x[0, 12:15] - np.cross(state.x[0, 15:], two.line))
        w = axes.T @ (state.x[1, 15:] - state.x[0, 15:])
        s = axes.T @ two.axes[1] @ shaft
        F = np.append(-K @ d[:2] - D @ d_dot[:2], -k_a * d[2] - d_a * d_dot[2])
        tilt = np.array([-s[1], s[0], 0.0])
        wrench = two.force_at(axes @ F, state.x[1, :3])
        M = axes @ (-k_t * tilt - d_t * (w - (s @ w) * s))
        wrench[1, 3:] += M
        wrench[0, 3:] -= M
        K_s = (K + K.T) / 2
        energy = (d[:2] @ K_s @ d[:2] + k_a * d[2] ** 2) / 2 + k_t * (1 - s[2])
        lost = d_dot[:2] @ ((K - K_s) @ d[:2] + D @ d_dot[:2]) + d_a * d_dot[2] ** 2 + d_t * (w @ w - (s @ w) ** 2)
        names = ("x", "y", "axial", "tilt x", "tilt y", "force x", "force y", "axial force", "energy", "power lost")
        return wrench, {}, dict(zip(names, (*d, *tilt[:2], *F, energy, lost), strict=True))

    states = []
    for seed, lean in ((1, 0.05), (2, 0.4)):
        x = pair(seed, offset=C @ [0.02, -0.013, 0.01], start=START, angle=2.0)
        A_a, A_b = Pair(x).axes
        x[1, 3:12] = (Rotation.from_rotvec(A_a @ C @ [lean, 0.7 * lean, 0]).as_matrix() @ A_b).ravel()
        states.append(State(x))
    return Form(element, START, tuple(states), closed)


def bristles(motion, creeps):
    """Return friction by bristles that stick, begin to slip, slip, and are relieved."""
    F_C, k, F_S, v_S, sigma_1, sigma_2, elastic = 40.0, 9e3, 70.0, 0.4, 12.0, 3.0, 0.6
    element = BristleFriction("f", A, B, F_C, k, F_S, v_S, sigma_1, sigma_2, 0.0 if creeps else elastic, creeps, motion,
                              speed=0.2, axis=AXIS)  # fmt: skip
    is_turn = motion == "about"

    def closed(state):
        two, z = Pair(state.x), state.z["deflection"]
        v = two.turning if is_turn else two.sliding
        z_ss = (F_C + (F_S - F_C) * exp(-((v / v_S) ** 2))) / k
        alpha = 1.0
        if not creeps:
            part = (abs(z) / z_ss - elastic) / (1 - elastic)
            alpha = 0.0 if z * v <= 0 or part <= 0 else 1.0 if part >= 1 else (1 - np.cos(pi * part)) / 2
        rate = v * (1 - alpha * z / z_ss * np.sign(v))
        force = k * z + sigma_1 * rate + sigma_2 * v
        seen = {"force": force, "velocity": v, "energy": k * z * z / 2, "power lost": force * v - k * z * rate}
        return (two.torque if is_turn else two.force)(-force), {"deflection": rate}, seen

    states = []
    for seed, v, z in ((1, 0.3, 5e-3), (2, 0.2, 6.5e-3), (3, -0.5, -9e-3), (4, 0.1, 2e-3), (5, -0.4, 3e-3)):
        x = pair(seed, relative=v * AXIS + 0.1 * NORMAL)
        if is_turn:
            x[1, 15:] = x[0, 15:] + v * Pair(x).e + 0.3 * np.cross(Pair(x).e, [1.0, 2.0, 0.0])
        states.append(State(x, {"deflection": z}))
    return Form(
        element,
        START,
        tuple(states),
        closed,
        {place: "as any number above 0" for place, is_on in ((7, creeps), (8, is_turn)) if is_on},
    )


# Tyres ----------------------------------------------------------------------------------------------------------------


TYRE = {
    "radius": 0.31, "stiffness": 2e5, "damping": 700.0, "relaxation_x": 0.21, "relaxation_y": 0.43,
    "rolling_resistance": 0.013, "flattening": 0.37, "low_speed": 2.0, "settling_time": 0.03, "landing_depth": 6e-3,
}  # fmt: skip
WHEEL = np.array([0.2, 0.97, -0.1]) / np.linalg.norm([0.2, 0.97, -0.1])  #: spin axis, axes of marker b
GRIP = FlatRoad(Grip([-0.5, 0.5, 1.5], [0.6, 0.9, 0.7]))


def rolling(seed, depth, V, lateral, slip, lean=0.08, R=TYRE["radius"], axis=WHEEL):
    """Return a wheel on a road that moves and is turned: deflection, speed along x and y, Omega R = V (1 + slip)."""
    rng = np.random.default_rng(seed)
    A_a = Rotation.random(random_state=seed).as_matrix()
    o, v_a, omega_a = rng.normal(size=3) * 40.0, rng.normal(size=3), 0.1 * rng.normal(size=3)
    heading = rng.uniform(-0.3, 0.3)
    e_road = Rotation.from_euler("zx", [heading, 0.0]).as_matrix() @ [0.0, np.cos(lean), np.sin(lean)]
    x_road = np.cross(e_road, [0, 0, 1.0])
    x_road /= np.linalg.norm(x_road)
    u = np.cross(x_road, e_road)
    centre = np.array([0.3 + 0.5 * (seed % 2), -0.2, 0.0]) + (R - depth) * u
    centre[2] = (R - depth) * u[2]
    side = np.cross(axis, rng.normal(size=3))
    side /= np.linalg.norm(side)
    B_axes = np.column_stack([x_road, e_road, u]) @ np.column_stack([side, axis, np.cross(side, axis)]).T
    r = A_a @ centre
    spin = V * (1 + slip) / R
    v = V * x_road + lateral * np.cross([0, 0, 1.0], x_road) + rng.normal(size=3) * [0, 0, 0.05]
    return np.array([
        marker_motion(o, A_a, v_a, omega_a),
        marker_motion(o + r, A_a @ B_axes, v_a + np.cross(omega_a, r) + A_a @ v,
                      omega_a + A_a @ (spin * e_road + [0.02, 0.01, 0.2])),
    ])  # fmt: skip


def touch(x):
    """Return axes of the contact, its place, deflection, loaded radius, inclination, velocities and spin."""
    A_a, A_b = Pair(x).axes
    n, e = A_a[:, 2], A_b @ WHEEL
    sine = e @ n
    x_W = np.cross(e, n) / np.linalg.norm(np.cross(e, n))
    y_W, u = np.cross(n, x_W), np.cross(x_W, e)
    rho = n @ (x[1, :3] - x[0, :3]) / sqrt(1 - sine**2)
    point = x[1, :3] - rho * u
    Omega = e @ (x[1, 15:] - x[0, 15:])
    V = x[1, 12:15] + np.cross(x[1, 15:] - Omega * e, -rho * u) - x[0, 12:15] - np.cross(x[0, 15:], point - x[0, :3])
    return x_W, y_W, n, point, rho, sine, V, Omega


def tread(z, V, V_s, sigma, slide, landed):
    """Return slips and rates of the tread: rolling, and near a standstill with damping and loss."""
    low, tau = TYRE["low_speed"], TYRE["settling_time"]
    q = min(abs(V) / low, 1.0)
    fade = (1 - q**2) ** 2
    stretch = np.array(z) / (sigma * slide)
    s = np.linalg.norm(stretch)
    loss = 0.0
    if s > 1:
        w = min(s - 1, 1.0)
        loss = 0.5 * fade * w * w * (3 - 2 * w) * np.linalg.norm(V_s / (sigma * slide))
    rate = landed * V_s * [-1, 1] - (abs(V) / sigma + loss) * z
    return (z + tau * fade * rate) / sigma, rate - (1 - landed) * 20 * low / sigma * z


def tyre(kind):
    """Return a linear or a brush tyre: rolling, sliding, landing, standing and lifted."""
    k, c, R, q = TYRE["stiffness"], TYRE["damping"], TYRE["radius"], TYRE["flattening"]
    sigma = np.array([TYRE["relaxation_x"], TYRE["relaxation_y"]])
    linear = {
        "slip_stiffness": 8e4,
        "cornering_stiffness": 6e4,
        "camber_stiffness": 4e3,
        "trail": 0.03,
        "friction": 0.9,
    }
    brush = {"nominal_load": 3e3, "slip_stiffness": 7e4, "contact_length": 0.12, "friction": 0.9}
    own = linear if kind == "linear" else brush
    make = LinearTyre if kind == "linear" else BrushTyre
    element = make("t", A, B, axis=WHEEL, road=GRIP, **TYRE, **own)

    def closed(state):
        x = state.x
        x_W, y_W, n, point, rho, sine, V, Omega = touch(x)
        d, cosine = R - rho, sqrt(1 - sine**2)
        rate = -V @ n / cosine
        s = min(max(d / TYRE["landing_depth"], 0.0), 1.0)
        landed = s * s * (3 - 2 * s)
        F_z = max((k * d + c * landed * rate) / cosine, 0.0) if d > 0 else 0.0
        R_e = R - q * max(d, 0.0)
        V_x, V_y = V @ x_W, V @ y_W
        V_s = np.array([V_x - R_e * Omega, V_y])
        along = (Pair(x).axes[0].T @ (point - x[0, :3]))[0]
        mu = own["friction"] * np.interp(along, GRIP.grip.x, GRIP.grip.factor)
        z = np.array([state.z["u"], state.z["v"]])
        if kind == "linear":
            stiff = np.array([own["slip_stiffness"], own["cornering_stiffness"]])
            slide = np.maximum(mu * F_z / stiff, 1e-4)
            slip, rates = tread(z, V_x, V_s, sigma, slide, landed)
            F = np.array([stiff[0] * slip[0], -stiff[1] * slip[1] - own["camber_stiffness"] * sine]) * (d > 0)
            arm = own["trail"] * stiff[1] * slip[1] * (d > 0)
            share = min(1.0, mu * F_z / hypot(*F)) if hypot(*F) > 0 else 1.0
            F, M_z = share * F, share * arm
            roll = R * Omega / TYRE["low_speed"]
            held = 0.5 * stiff / sigma @ z**2
            rising = stiff / sigma @ (z * rates)
        else:
            C, F_0 = own["slip_stiffness"], own["nominal_load"]
            sliding = 3 * mu * F_0 / C
            slip, rates = tread(z, R_e * Omega, V_s, sigma, np.full(2, sliding), landed)
            r, a = hypot(*slip) / sliding, own["contact_length"] / 2 * sqrt(F_z / F_0)
            grown = mu * F_z * (3 * r - 3 * r**2 + r**3 if r < 1 else 1.0)
            F = grown * slip * [1, -1] / hypot(*slip)
            trail = a / 3 * (1 - r) ** 3 / (1 - r + r**2 / 3) if r < 1 else 0.0
            roll = R_e * Omega / TYRE["low_speed"]
            held, rising = 0.0, 0.0
        roll = min(max(roll, -1.0), 1.0)
        sense = 0.5 * roll * (3 - roll**2)
        if kind == "brush":
            M_z = -trail * F[1] * sense
        M = np.array([0.0, -TYRE["rolling_resistance"] * R * F_z * sense - (R_e - rho) * F[0], M_z])
        axes = np.column_stack([x_W, y_W, n])
        wrench = Pair(x).force_at(axes @ [*F, F_z], point)
        wrench[1, 3:] += axes @ M
        wrench[0, 3:] -= axes @ M
        power = (wrench * x[:, 12:]).sum()
        energy = 0.5 * k * max(d, 0.0) ** 2 + held
        names = ("Fx", "Fy", "Fz", "Mx", "My", "Mz", "kappa", "alpha", "gamma", "deflection", "loaded_radius", "Vx",
                 "Vsx", "Vsy", "px", "py", "pz", "energy", "power_lost")  # fmt: skip
        seen = dict(zip(names, (*F, F_z, *M, slip[0], atan(slip[1]), atan(sine / cosine), d, rho, V_x, *V_s, *point,
                                energy, -power - k * max(d, 0.0) * rate - rising), strict=True))  # fmt: skip
        return wrench, {"u": rates[0], "v": rates[1]}, seen

    states = tuple(
        State(rolling(seed, *how), {"u": u, "v": v})
        for seed, (how, u, v) in enumerate((
            ((0.011, 15.0, 0.3, 0.02), 3e-3, 4e-3), ((0.014, -12.0, 0.2, -0.03), -2e-3, -8e-3),
            ((0.012, 14.0, 3.0, 0.1), 0.02, 0.09), ((0.004, 16.0, 0.4, 0.03), 5e-3, 7e-3),
            ((0.013, 0.7, 0.2, 0.4), 4e-3, 6e-3), ((0.012, -0.5, -0.3, 2.0), 0.015, -0.03),
            ((-0.01, 9.0, 0.1, 0.01), 2e-3, 3e-3), ((0.012, 0.4, 0.3, -2.5), 0.2, 0.1),
        ))
    )  # fmt: skip
    silent = {11 + k: "as placed: for statics" for k in range(12)}
    placed = rolling(99, 0.01, 0.0, 0.0, 0.0)

    def at_rest(state):
        """A tread that is stretched by what the wheel has moved and turned on its road since it was placed."""
        wrench, _, seen = closed(state)
        (A_0, B_0), (A_1, B_1) = Pair(placed).axes, Pair(state.x).axes
        gone = A_1.T @ Pair(state.x).line - A_0.T @ Pair(placed).line
        Q = A_1.T @ B_1 @ (A_0.T @ B_0).T
        turned = 0.5 * np.array([Q[2, 1] - Q[1, 2], Q[0, 2] - Q[2, 0], Q[1, 0] - Q[0, 1]])  # small: half the skew part
        e = A_1.T @ B_1 @ WHEEL
        ahead = np.array([e[1], -e[0], 0.0]) / hypot(e[0], e[1])
        R_e, rho = (2 * R + seen["loaded_radius"]) / 3, seen["loaded_radius"]
        u = -(gone @ ahead - R_e * turned @ e)
        v = gone @ np.cross([0, 0, 1.0], ahead) + rho * turned @ ahead
        del seen["power_lost"]  # of the tread in motion
        return wrench, {"u": u - state.z["u"], "v": v - state.z["v"]}, seen

    stood = []
    for seed in range(3):  # a wheel that has moved a little on a road that is anywhere
        x = rolling(seed, 0.012, 0.0, 0.0, 0.0)
        A_a = Pair(x).axes[0]
        A_0, B_0 = Pair(placed).axes
        x[1, :3] = x[0, :3] + A_a @ (A_0.T @ Pair(placed).line + [0.004 * seed - 0.003, 0.002, -0.001])
        turn = Rotation.from_rotvec(0.02 * np.random.default_rng(seed).normal(size=3)).as_matrix()
        x[1, 3:12] = (A_a @ turn @ A_0.T @ B_0).ravel()
        stood.append(State(x, {"u": 1e-3, "v": 2e-3}))
    as_placed = [11, 12, *range(14, 23)]
    return (
        Form(element, placed, states, closed, silent),
        Form(element, placed, tuple(stood), at_rest, is_rest=True, places=lambda data: as_placed),
    )


FORMS = {
    "bearing": bearing(),
    "backlash along": backlash("along"),
    "backlash about": backlash("about"),
    "ball with play": ball(),
    "hinge with play": hinge(slides=False),
    "hinge with play that slides": hinge(slides=True),
    "hinge with play in one plane": hinge(slides=False, length=0.0),
    **{f"bristles {motion}{' that creep' * creeps}": bristles(motion, creeps)
       for motion in ("along", "about") for creeps in (False, True)},
    **{f"{kind} tyre{' at rest' * k}": form for kind in ("linear", "brush") for k, form in enumerate(tyre(kind))},
}  # fmt: skip

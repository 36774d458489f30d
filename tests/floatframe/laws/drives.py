"""Drives and brakes in closed form, from the text of their classes."""

from math import exp, pi

import numpy as np
from scipy.integrate import quad
from scipy.interpolate import RegularGridInterpolator

from floatframe.components.drives import AntiSkidBrake, DcMotor, InductionMotor, Pid, PidDrive, SpeedControl, TorqueMap
from tests.floatframe.laws.form import AXIS, TIME, A, B, Form, Pair, State, friction, on_pair, pair, wave, wave_at

__all__ = ["FORMS"]

START = pair(100)
TURNED = {"start": START, "angle": 0.8}  #: b turned by that angle about the axis since it was placed
FULL = 3  #: turns that the counted angle has made


def pid_of(mode="clamping", **changes):
    """Return a controller with all its numbers."""
    numbers = {"kp": 2.0, "ki": 5.0, "kd": 0.3, "filter_time": 0.02, "lower": -40.0, "upper": 55.0,
               "tracking_time": 0.25, "integral": 0.7}  # fmt: skip
    return Pid(wave(4.0), anti_windup=mode, **(numbers | changes))


def controlled(pid, value, z, t):
    """Return the limited output of a controller, and the rates of its states."""
    e = wave_at(4.0, t) - value
    rate = (e - z["filtered error"]) / pid.filter_time
    u = pid.kp * e + z["integral"] + pid.kd * rate
    limited = min(max(u, pid.lower), pid.upper)
    growth = pid.ki * e
    if pid.anti_windup == "back-calculation":
        growth += (limited - u) / pid.tracking_time
    elif pid.anti_windup == "clamping":
        room = (pid.upper - u if growth > 0 else u - pid.lower) / (1e-3 * (pid.upper - pid.lower))
        s = min(max(room, 0.0), 1.0)
        growth *= s * s * (3 - 2 * s)
    return limited, {"integral": growth, "filtered error": rate}


def near_limit(pid, value):
    """Return an integral that puts the output into the middle of the band where clamping sets in, filter at rest."""
    e = wave_at(4.0, TIME) - value
    end, inward = (pid.upper, -1.0) if e > 0 else (pid.lower, 1.0)
    return {"integral": end + inward * 0.4e-3 * (pid.upper - pid.lower) - pid.kp * e, "filtered error": e}


def pid_states(pid, x, value, more=()):
    """Return states of a controller: inside its limits, beyond each of them, in the band of clamping."""
    e = wave_at(4.0, TIME) - value
    free = [{"integral": i, "filtered error": e - d} for i, d in ((1.0, 0.3), (900.0, 2.0), (-900.0, 2.0))]
    return tuple(State(x, {**z, **dict(more)}) for z in (*free, near_limit(pid, value)))


def normals(at):
    """Return the numbers of the normals of an axis at a place of the data, where no angle is asked for."""
    normal = np.cross(AXIS, np.eye(3)[int(np.argmin(np.abs(AXIS)))])
    return {at + 3 + k: "normals and rate: for an angle alone" for k in range(7) if k > 2 or normal[k] != 0}


def pid_silent(pid, at):
    """Return the numbers of a controller at a place of the data that its way against winding up does not use."""
    if pid.anti_windup == "clamping":
        return {at + 7: "time of the other way, back-calculation"}
    return {at + 8: "band of the other way, clamping"}


def dc_motor(controlled_by):
    """Return a motor by a voltage, or by a controller of what it is called by."""
    R, L, k, ratio, dry, slow, damping = 0.5, 2e-3, 0.07, -3.0, 0.2, 2.5, 0.013
    pid = pid_of() if controlled_by else None
    supply = {"controller": pid, "controlled": controlled_by} if pid else {"voltage": wave(6.0, 20.0)}
    motor = DcMotor("m", A, B, R, L, k, axis=AXIS, ratio=ratio, friction=dry, friction_speed=slow, damping=damping,
                    current=3.0, **supply)  # fmt: skip

    def closed(state):
        two, i = Pair(state.x), state.z["current"]
        omega = ratio * two.turning
        rates = {}
        if pid is None:
            u = wave_at(6.0, state.t, 20.0)
        else:
            angle = TURNED["angle"] + 2 * pi * FULL
            value = {"speed": two.turning, "angle": angle, "current": i}[controlled_by]
            u, rates = controlled(pid, value, state.z, state.t)
            rates["counted angle"] = two.turning + angle - state.z.get("counted angle", 0.0)
        rates["current"] = (u - R * i - k * omega) / L
        resisting = friction(dry, slow, omega) + damping * omega
        torque = ratio * (k * i - resisting)
        seen = {"current": i, "voltage": u, "torque": torque, "speed": two.turning, "power in": u * i,
                "power lost": R * i * i + resisting * omega, "power out": torque * two.turning,
                "energy": 0.5 * L * i * i}  # fmt: skip
        return two.torque(torque), rates, seen

    if pid is None:
        states = on_pair((1, 2), ({"current": 4.0}, {"current": -1.5}), **TURNED)
        return Form(motor, START, states, closed, normals(8), (motor.voltage,))
    x = pair(1, **TURNED)
    counted = {"counted angle": TURNED["angle"] + 2 * pi * FULL + 0.3, "current": 4.0}
    value = {"speed": Pair(x).turning, "angle": TURNED["angle"] + 2 * pi * FULL, "current": 4.0}[controlled_by]
    silent = pid_silent(pid, 18) | ({} if controlled_by == "angle" else normals(8))
    if controlled_by == "current":
        silent[7] = "the last of the modes, as any number beyond them"
    return Form(motor, START, pid_states(pid, x, value, counted), closed, silent, (pid.target,))


def induction_motor(by_voltage):
    """Return a motor by a voltage, or by the ratio of voltage and frequency below and above the rated one."""
    R_s, R_r, L_ls, L_lr, L_m, p, ratio, damping = 0.4, 0.3, 2e-3, 3e-3, 0.06, 2, -1.5, 0.02
    harmonics = np.array([[-5.0, 0.2], [7.0, -0.14]])
    rated, boost = (300.0, 50.0), 12.0
    supply = {"voltage": wave(30.0, 200.0)} if by_voltage else {
        "rated_voltage": rated[0], "rated_frequency": rated[1], "boost": boost}  # fmt: skip
    motor = InductionMotor("m", A, B, R_s, R_r, L_ls, L_lr, L_m, p, wave(8.0, 20.0), harmonics=harmonics, axis=AXIS,
                           ratio=ratio, damping=damping, fluxes=(0.1, 0.2, 0.3, 0.4), **supply)  # fmt: skip
    names = ("stator flux a", "stator flux b", "rotor flux a", "rotor flux b")

    def closed(state):
        two = Pair(state.x)
        psi_s, psi_r = (complex(state.z[names[k]], state.z[names[k + 1]]) for k in (0, 2))
        f = wave_at(8.0, state.t, 20.0)
        theta = 2 * pi * quad(motor.frequency, 0.0, state.t, points=[0.2], epsabs=1e-13)[0]
        U = wave_at(30.0, state.t, 200.0) if by_voltage else boost + (rated[0] - boost) * min(1, abs(f) / rated[1])
        u = U * np.exp(1j * theta) + sum(U * part * np.exp(1j * order * theta) for order, part in harmonics)
        inductances = np.array([[L_ls + L_m, L_m], [L_m, L_lr + L_m]])
        i_s, i_r = np.linalg.solve(inductances, [psi_s, psi_r])
        omega = ratio * two.turning
        d_s, d_r = u - R_s * i_s, 1j * p * omega * psi_r - R_r * i_r
        torque = ratio * (1.5 * p * (psi_s.conjugate() * i_s).imag - damping * omega)
        rates = dict(zip(names, (d_s.real, d_s.imag, d_r.real, d_r.imag), strict=True))
        phases = [(i_s * np.exp(-2j * pi * k / 3)).real for k in range(3)]
        heat = 1.5 * (R_s * abs(i_s) ** 2 + R_r * abs(i_r) ** 2)
        seen = {"torque": torque, "speed": two.turning, "slip": 1 - p * omega / (2 * pi * f), "frequency": f,
                "voltage": U, "current": abs(i_s), "current 1": phases[0], "current 2": phases[1],
                "current 3": phases[2], "rotor current": abs(i_r), "power in": 1.5 * (u * i_s.conjugate()).real,
                "power lost": heat + damping * omega**2, "power out": torque * two.turning,
                "energy": 0.75 * (psi_s * i_s.conjugate() + psi_r * i_r.conjugate()).real}  # fmt: skip
        return two.torque(torque), rates, seen

    z = dict(zip(names, (0.7, -0.3, 0.5, 0.6), strict=True))
    return Form(
        motor,
        START,
        (State(pair(1, **TURNED), z), State(pair(2, **TURNED), z, 1.1)),
        closed,
        functions=(motor.voltage,) if by_voltage else (),
    )


def torque_map(by_controller):
    """Return a motor by its map with a lag and an efficiency, on its throttle or a controller."""
    speeds, throttles, sizes = (-9.0, 0.0, 14.0), (-60.0, 0.3, 70.0), (0.0, 40.0, 90.0)
    torques = np.array([[-31.0, 12.0, 55.0], [-42.0, 7.0, 61.0], [-27.0, 3.0, 38.0]])
    efficiencies = np.array([[0.5, 0.8, 0.7], [0.4, 0.9, 0.75], [0.55, 0.85, 0.65]])
    ratio, lag, pid = -3.0, 0.04, pid_of("back-calculation")
    supply = {"controller": pid} if by_controller else {"throttle": wave(9.0, -30.0)}
    motor = TorqueMap("m", A, B, speeds, throttles, torques, time_constant=lag, ratio=ratio, axis=AXIS,
                      efficiency_torques=sizes, efficiencies=efficiencies, **supply)  # fmt: skip
    grid = RegularGridInterpolator((speeds, throttles), torques)
    eta_of = RegularGridInterpolator((speeds, sizes), efficiencies)

    def closed(state):
        two, T = Pair(state.x), state.z["motor torque"]
        rates = {}
        throttle = wave_at(9.0, state.t, -30.0)
        if by_controller:
            throttle, rates = controlled(pid, two.turning, state.z, state.t)
        omega = ratio * two.turning
        inside = np.clip(omega, speeds[0], speeds[-1])
        rates["motor torque"] = (grid((inside, throttle)) - T) / lag
        power = ratio * T * two.turning
        eta = float(eta_of((inside, abs(T))))
        given = power / eta if power > 0 else power * eta
        seen = {"torque": ratio * T, "speed": two.turning, "throttle": throttle, "efficiency": eta, "power in": given,
                "power lost": given - power, "power out": power}  # fmt: skip
        return two.torque(ratio * T), rates, seen

    if not by_controller:
        return Form(
            motor,
            START,
            on_pair(range(1, 9), ({"motor torque": 20.0}, {"motor torque": -60.0})),
            closed,
            functions=(motor.throttle,),
        )
    torques_now = [{"motor torque": 23.0 * (seed % 5) - 50.0} for seed in range(1, 9)]
    states = [s for k, T in enumerate(torques_now) for s in pid_states(pid, pair(k + 1), 0.0, T)]
    silent = {2: "a controller, as any number but 0 says", **pid_silent(pid, 45)}
    return Form(motor, START, tuple(states), closed, silent, (pid.target,))


def speed_control():
    """Return a control of the speed with a filtered rate, below and beyond its limit."""
    gain, rate_time, filter_time, limit = 3.0, 0.4, 0.03, 25.0
    drive = SpeedControl("m", A, B, wave(2.0), gain, rate_time, filter_time, AXIS, limit, speed=0.5)

    def closed(state):
        two, rate = Pair(state.x), (Pair(state.x).turning - state.z["filtered speed"]) / filter_time
        torque = gain * (wave_at(2.0, state.t) - two.turning) - gain * rate_time * rate
        torque = min(max(torque, -limit), limit)
        seen = {"torque": torque, "speed": two.turning, "target": wave_at(2.0, state.t),
                "power in": torque * two.turning}  # fmt: skip
        return two.torque(torque), {"filtered speed": rate}, seen

    x = pair(1)
    near = [{"filtered speed": Pair(x).turning + d} for d in (0.01, -0.02, 0.9, -0.9)]
    return Form(drive, START, tuple(State(x, z) for z in near), closed, functions=(drive.target,))


def pid_drive(by):
    """Return a controller that acts by itself, with the lag of its actuator."""
    pid, lag = pid_of("back-calculation"), 0.06
    drive = PidDrive("m", A, B, pid, by, AXIS, lag)
    is_turn = by in ("angle", "speed")
    acting = "torque" if is_turn else "force"

    def value_of(two):
        angle = TURNED["angle"] + 2 * pi * FULL
        return {"angle": angle, "speed": two.turning, "distance": two.way, "rate": two.sliding}[by]

    def closed(state):
        two, u = Pair(state.x), state.z[acting]
        value, rate = value_of(two), two.turning if is_turn else two.sliding
        wanted, rates = controlled(pid, value, state.z, state.t)
        rates[acting] = (wanted - u) / lag
        rates["counted angle"] = two.turning + value - state.z["counted angle"]
        seen = {by: value, acting: u, "power in": u * rate, "error": wave_at(4.0, state.t) - value}
        return (two.torque(u) if is_turn else two.force(u)), rates, seen

    x = pair(1, **TURNED)
    z = {acting: 8.0, "counted angle": TURNED["angle"] + 2 * pi * FULL - 0.4}
    silent = pid_silent(pid, 12) | ({} if by == "angle" else normals(2))
    if by == "distance":
        silent[0] = "neither an angle, a speed nor a rate, as any other number says"
    return Form(drive, START, pid_states(pid, x, value_of(Pair(x)), z), closed, silent, (pid.target,))


BRAKE = {
    "gain": 3e-4, "build_rate": 3e7, "release_rate": 1.2e8, "radius": 0.31, "slip": 0.15, "slip_band": 0.05,
    "reference_deceleration": 8.0, "drop_out": 5.0, "deceleration": 40.0, "deceleration_band": 22.0,
    "reference_time": 0.03, "sensor_time": 4e-3, "time_constant": 0.015, "friction_speed": 0.7,
}  # fmt: skip


def anti_skid_brake(anti_skid):
    """Return a brake whose valve watches the wheel, or not: steps (1) to (5) of its class."""
    brake = AntiSkidBrake("m", A, B, wave(1e6, 9e6), anti_skid=anti_skid, axis=AXIS, speed=30.0, **BRAKE)
    b = brake

    def closed(state):
        two = Pair(state.x)
        omega_s, v, p_v, p = (state.z[k] for k in ("sensed speed", "reference speed", "valve pressure", "pressure"))
        sensed = (two.turning - omega_s) / b.sensor_time
        v_w = b.radius * omega_s
        reference = max((v_w - v) / b.reference_time, -b.reference_deceleration)
        s = (v - v_w) / max(v, b.drop_out)
        skid = max((s - b.slip) / b.slip_band, (-b.radius * sensed - b.deceleration) / b.deceleration_band)
        rate = b.build_rate
        if anti_skid:
            in_ = float(np.clip(2 * v / b.drop_out - 1, 0, 1))
            in_ = in_ * in_ * (3 - 2 * in_)
            valve = b.build_rate * min(max(-skid, 0), 1) - b.release_rate * min(max(skid, 0), 1)
            rate = in_ * valve + (1 - in_) * b.build_rate
        pilot = wave_at(1e6, state.t, 9e6)
        rate = max(min(rate, (pilot - p_v) / b.time_constant), -p_v / b.time_constant)
        torque = -b.gain * p * (1 - 2 / (exp(2 * two.turning / b.friction_speed) + 1))
        rates = {"sensed speed": sensed, "reference speed": reference, "valve pressure": rate,
                 "pressure": (p_v - p) / b.time_constant}  # fmt: skip
        seen = {"torque": torque, "pressure": p, "pilot pressure": pilot, "speed": two.turning, "wheel speed": v_w,
                "reference speed": v, "slip": s, "skid": skid, "power lost": -torque * two.turning}  # fmt: skip
        return two.torque(torque), rates, seen

    states = []
    for seed, v, slip, lag, p_v in (
        (1, 20.0, 0.16, 0.02, 5e6), (2, 4.0, 0.14, 0.01, 5e6), (3, 30.0, 0.5, -0.02, 6e6), (4, 3.0, 0.135, 0.01, 5e6),
        (5, 20.0, 0.13, 0.6, 5e6), (6, 20.0, -0.03, 0.03, 5e6), (7, 20.0, 0.13, 0.65, 4e6), (8, 20.0, 0.4, 0.05, 1e6),
        (9, 20.0, 0.13, 0.6, 1.05e7),
    ):  # fmt: skip
        x = pair(seed)
        omega_s = v * (1 - slip) / b.radius
        x[1, 15:] += (omega_s - lag - Pair(x).turning) * Pair(x).e
        z = {"sensed speed": omega_s, "reference speed": v, "valve pressure": p_v, "pressure": 4e6}
        states.append(State(x, z))
    slow = pair(10)  # a wheel that nearly stands: the friction of its disc
    slow[1, 15:] += (0.41 - Pair(slow).turning) * Pair(slow).e
    states.append(State(slow, {"sensed speed": 0.4, "reference speed": 1.0, "valve pressure": 5e6, "pressure": 4e6}))
    silent = {} if anti_skid else {2: "release_rate: nothing watches the wheel"}
    return Form(brake, START, tuple(states), closed, silent, (brake.pressure,))


FORMS = {
    "dc motor by voltage": dc_motor(""),
    **{f"dc motor by {by}": dc_motor(by) for by in ("speed", "angle", "current")},
    "induction motor by voltage": induction_motor(True),
    "induction motor by V/f": induction_motor(False),
    "torque map": torque_map(False),
    "torque map by controller": torque_map(True),
    "speed control": speed_control(),
    **{f"pid by {by}": pid_drive(by) for by in ("angle", "speed", "distance", "rate")},
    "anti-skid brake": anti_skid_brake(True),
    "brake": anti_skid_brake(False),
}

"""The law of a circuit: flows between nodes, pressures as states, cylinder forces and pump torques.

v(p) and h(p) are those of the fluid (`floatframe.components.hydraulics.fluid`). Flows q are volumes at ambient pressure
per time. At node i, V is the volume of the connected chambers and dead volumes, C (p - p_a) their elastic growth, and
U(p) the oil in accumulators.

(1) each component has the flow q from its node a to its node b; it dissipates the power q (h_a - h_b);
(2) a cylinder pushes its ends apart with the force (p_head - p_a) A_head - (p_rod - p_a) A_rod minus friction, and has
    stops at both ends;
(3) a pump or motor of displacement D has the flow q = D omega and the torque D (h_a - h_b);
(4) a pipe's flow has inertia, I dq/dt = h_a - h_b - R q - c q |q|;
(5) the content (V + C (p - p_a) + U)/v of each node is conserved:
    dp/dt (v (C + dU/dp) - (V + C (p - p_a) + U) dv/dp) = v (v Q - dV/dt),
    with the sum Q of the flows into the node.

The energy of nodes and pipes grows by exactly the energy that supplies add, minus losses and the work on bodies.
"""

import numpy as np
from numba import njit
from numba.extending import register_jitable

from floatframe.components.hydraulics.fluid import compression
from floatframe.components.hydraulics.gas import oil_in_accumulator
from floatframe.components.hydraulics.stops import stop_force
from floatframe.model.elements.curves import function_at
from floatframe.model.elements.pairs import add_torque, direction_of, line_between, turning_speed

__all__ = ["circuit_law", "circuit_rest"]

# indices of the header of the data
N_NODES, N_FREE, N_COMPONENTS, NODES, COMPONENTS, ATTACHED, N_ISLANDS, ISLANDS, FLUID = range(9)
HEAD = FLUID + 6
AMBIENT = FLUID + 3
NODE_WIDTH = 6
VOLUME, COMPLIANCE, FUNCTION, FIRST, COUNT, LAMINAR = range(NODE_WIDTH)
COMPONENT_WIDTH = 22
KIND, A, B, SEEN, STATE, MARKER_A, MARKER_B, FIRST_NUMBER = range(8)
ORIFICE, VALVE, RESISTANCE, INERTIA, CYLINDER, ACCUMULATOR, FLOW, PUMP, SPOOL = range(1, 10)  # kinds of components
INTO, OUT_OF, HEAD_CHAMBER, ROD_CHAMBER, GAS = range(5)  # kinds of connection between a component and a node
TOTALS = ("power in", "power lost", "energy", "power out", "content")
ALWAYS, BY_FUNCTION, BY_SPOOL, BY_SPOOL_BACK = range(4)  # openings of orifices
LEAST_VOLUME = 0.01  # least volume of a chamber beyond its stop, relative to the dead volume


@register_jitable
def turbulent(dp, transition):
    """Return the signed root of a pressure difference, linear below the transition d: dp/(dp² + d²)^(1/4)."""
    return dp / np.sqrt(np.sqrt(dp * dp + transition * transition))


@register_jitable
def ramp(x):
    """Return the cubic from 0 at x = 0 to 1 at x = 1, with zero slope at both ends."""
    if x.real <= 0.0:
        return 0.0 * x
    if x.real >= 1.0:
        return 0.0 * x + 1.0
    return x * x * (3.0 - 2.0 * x)


@register_jitable
def size(x):
    """Return |x|, with the sign taken from the real part."""
    return -x if x.real < 0.0 else x


@register_jitable
def chamber(data, c, outputs, is_rod):
    """Return volume and rate of a chamber of the cylinder whose record begins at index c."""
    n, s = c + FIRST_NUMBER, int(data[c + SEEN])
    stroke, rate = outputs[s], outputs[s + 1]
    if is_rod:
        volume, dead = data[n + 1] * (data[n + 2] - stroke) + data[n + 5], data[n + 5]
        growth = -data[n + 1] * rate
    else:
        volume, dead = data[n] * stroke + data[n + 4], data[n + 4]
        growth = data[n] * rate
    if volume.real < LEAST_VOLUME * dead:
        return LEAST_VOLUME * dead + 0.0 * volume, 0.0 * growth
    return volume, growth


@register_jitable
def node_volume(data, i, p, outputs):
    """Return volume, its rate at constant pressure, its pressure derivative, energy of walls and gas, and inflow."""
    node = int(data[NODES]) + NODE_WIDTH * i
    P = p - data[AMBIENT]
    C = data[node + COMPLIANCE]
    V, growth, slope = data[node + VOLUME] + C * P, 0.0 * p, C + 0.0 * p
    energy, Q = 0.5 * C * P * P, 0.0 * p
    first, count = int(data[node + FIRST]), int(data[node + COUNT])
    for k in range(first, first + count):
        how, index = int(data[int(data[ATTACHED]) + 2 * k]), int(data[int(data[ATTACHED]) + 2 * k + 1])
        if how == INTO:
            Q = Q + outputs[index]
        elif how == OUT_OF:
            Q = Q - outputs[index]
        elif how == GAS:
            U, dU, area = oil_in_accumulator(p, data, index)
            V, slope, energy = V + U, slope + dU, energy + P * U - area
        else:
            part, rate = chamber(data, index, outputs, how == ROD_CHAMBER)
            V, growth = V + part, growth + rate
    return V, growth, slope, energy, Q


@njit
def circuit_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write forces, rates of pressures and flows, and outputs of a circuit, equations (1) to (5) of the module."""
    n_nodes, n_free = int(data[N_NODES]), int(data[N_FREE])
    for m in range(wrench.shape[0]):
        for j in range(6):
            wrench[m, j] = 0.0
    for i in range(n_nodes):
        node = int(data[NODES]) + NODE_WIDTH * i
        outputs[i] = z[i] if i < n_free else function_at(data, int(data[node + FUNCTION]), t)
    total = outputs.shape[0] - 5
    for k in range(total, total + 5):
        outputs[k] = 0.0
    p_a = data[AMBIENT]
    for k in range(int(data[N_COMPONENTS])):
        c = int(data[COMPONENTS]) + COMPONENT_WIDTH * k
        kind, a, b, s, n = int(data[c]), int(data[c + A]), int(data[c + B]), int(data[c + SEEN]), c + FIRST_NUMBER
        h_a, h_b, dp = 0.0 * outputs[0], 0.0 * outputs[0], 0.0 * outputs[0]
        if kind != SPOOL and kind != ACCUMULATOR:
            p_from = outputs[a] if a >= 0 else p_a + 0.0 * outputs[0]
            p_to = outputs[b] if b >= 0 else p_a + 0.0 * outputs[0]
            h_a, h_b = compression(p_from, data, FLUID)[2], compression(p_to, data, FLUID)[2]
            dp = p_from - p_to
        if kind == ORIFICE:  # parameters: conductance, transition, opening, index of the function, overlap, leakage
            how, at, part = int(data[n + 2]), int(data[n + 3]), 1.0 + 0.0 * dp
            if how == BY_FUNCTION:
                part = function_at(data, at, t) + 0.0 * dp
            elif how != ALWAYS:
                u = outputs[at] if how == BY_SPOOL else -outputs[at]
                part = (u - data[n + 4]) / (1.0 - data[n + 4])
            if part.real < 0.0 or (
                part.real == 0.0 and how == BY_SPOOL_BACK
            ):  # a centred spool has the slope of one path only
                part = 0.0 * part
            q = part * data[n] * turbulent(dp, data[n + 1]) + data[n + 5] * dp
            outputs[s] = q
            outputs[total + 1] += q * (h_a - h_b)
        elif kind == VALVE:  # parameters: conductance, transition, pressures at which it opens and is open, leakage
            part = ramp((dp - data[n + 2]) / (data[n + 3] - data[n + 2]))
            q = part * data[n] * turbulent(dp, data[n + 1]) + data[n + 4] * dp
            outputs[s] = q
            outputs[total + 1] += q * (h_a - h_b)
        elif kind == RESISTANCE:  # conductance
            q = data[n] * dp
            outputs[s] = q
            outputs[total + 1] += q * (h_a - h_b)
        elif kind == INERTIA:  # parameters: inertia, laminar resistance, turbulent resistance
            q = z[int(data[c + STATE])]
            drop = data[n + 1] * q + data[n + 2] * q * size(q)
            z_dot[int(data[c + STATE])] = (h_a - h_b - drop) / data[n]
            outputs[s] = q
            outputs[total + 1] += q * drop
            outputs[total + 2] += 0.5 * data[n] * q * q
        elif kind == FLOW:  # parameters: index of the function
            q = function_at(data, int(data[n]), t) + 0.0 * dp
            outputs[s] = q
            outputs[total] += q * (h_b - h_a)
        elif kind == PUMP:  # parameters: displacement, leakage, drag, axis
            i, j = int(data[c + MARKER_A]), int(data[c + MARKER_B])
            e = direction_of(x, i, data, n + 3)
            speed = turning_speed(x, i, j, e)
            torque = data[n] * (h_a - h_b) - data[n + 2] * speed
            leak = data[n + 1] * dp
            add_torque(wrench, i, j, torque, e)
            outputs[s], outputs[s + 1], outputs[s + 2] = data[n] * speed + leak, torque, speed
            outputs[total + 1] += leak * (h_a - h_b) + data[n + 2] * speed * speed
            outputs[total + 3] += torque * speed
        elif kind == CYLINDER:
            # parameters: areas of head and rod, stroke, retracted length, dead volumes, leakage, friction and its
            # speed, damping, stops
            i, j = int(data[c + MARKER_A]), int(data[c + MARKER_B])
            length, rate, e = line_between(x, i, j)
            stroke = length - data[n + 3]
            friction = data[n + 7] * rate / np.sqrt(rate * rate + data[n + 8] * data[n + 8]) + data[n + 9] * rate
            low, low_energy, low_lost = stop_force(-stroke, -rate, data[n + 10], data[n + 11])
            high, high_energy, high_lost = stop_force(stroke - data[n + 2], rate, data[n + 10], data[n + 11])
            force = (p_from - p_a) * data[n] - (p_to - p_a) * data[n + 1] - friction + low - high
            for m in range(3):
                wrench[j, m] += force * e[m]
                wrench[i, m] -= force * e[m]
            leak = data[n + 6] * dp
            outputs[s], outputs[s + 1], outputs[s + 2], outputs[s + 3] = stroke, rate, force, leak
            outputs[s + 4] = data[n + 2] - stroke
            outputs[total + 1] += leak * (h_a - h_b) + friction * rate + low_lost + high_lost
            outputs[total + 2] += low_energy + high_energy
            outputs[total + 3] += force * rate
        elif kind == SPOOL:  # parameters: time constant, index of the command, gain, index of the stroke
            u = function_at(data, int(data[n + 1]), t) + 0.0 * outputs[0]
            if data[n + 2] != 0.0:
                u = data[n + 2] * (u - outputs[int(data[n + 3])])
            if u.real > 1.0:
                u = 0.0 * u + 1.0
            if u.real < -1.0:
                u = 0.0 * u - 1.0
            if data[n] > 0.0:
                z_dot[int(data[c + STATE])] = (u - z[int(data[c + STATE])]) / data[n]
                u = z[int(data[c + STATE])]
            outputs[s] = u
        else:  # an accumulator
            outputs[s] = oil_in_accumulator(outputs[a], data, n)[0]
    for i in range(n_nodes):
        p = outputs[i]
        v, dv, h = compression(p, data, FLUID)
        V, growth, slope, energy, Q = node_volume(data, i, p, outputs)
        if i < n_free:
            z_dot[i] = v * (v * Q - growth) / (v * slope - V * dv)
            outputs[total + 2] += V * (h / v - (p - p_a)) + energy
            outputs[total + 4] += V / v
        else:
            outputs[total] += (p - p_a) * growth - Q * h


@njit
def circuit_rest(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write results as `circuit_law`, with pressure rates that are easier to solve and have the same zeros.

    The flow Q into a node depends on roots of pressure differences, about whose zeros Newton's method would oscillate.
    Q sqrt(Q² + Q_0²)/Q_0, with the flow Q_0 at which the orifices of the node become laminar, is proportional to the
    differences.

    For one node of each isolated part, the rate is the error of the content of the part. Nothing flows into or out of
    such a part, so that its initial content determines its pressures at rest.
    """
    circuit_law(t, x, z, lam, data, wrench, z_dot, g, outputs)
    for i in range(int(data[N_FREE])):
        scale = data[int(data[NODES]) + NODE_WIDTH * i + LAMINAR]
        if scale > 0.0:
            v, dv, _ = compression(z[i], data, FLUID)
            V, _, slope, _, Q = node_volume(data, i, z[i], outputs)
            z_dot[i] = v * v * Q * np.sqrt(Q * Q + scale * scale) / scale / (v * slope - V * dv)
    at = int(data[ISLANDS])
    for _ in range(int(data[N_ISLANDS])):
        # parameters: number of nodes, content, pressure for a relative defect of one, node numbers
        n, content, scale = int(data[at]), data[at + 1], data[at + 2]
        held = 0.0 * z[0]
        for k in range(n):
            i = int(data[at + 3 + k])
            held = held + node_volume(data, i, z[i], outputs)[0] / compression(z[i], data, FLUID)[0]
        z_dot[int(data[at + 3])] = scale * (1.0 - held / content)
        at += 3 + n

"""The Magic Formula written a second time, term by term from the equations of the textbook, with NumPy alone.

Pacejka (2012) for 6.1, the second edition of the same book for 5.2. No turn slip; zeta = 1.
"""

import numpy as np
from numpy import arctan, cos, exp, pi, sign, sin, sqrt, tan


class Curve:
    """y = D sin or cos of the arctangent of an arctangent."""

    def __init__(self, B, C, D, E):
        self.B, self.C, self.D, self.E = B, C, D, min(E, 1.0)

    def inner(self, x):
        Bx = self.B * x
        return self.C * arctan(Bx - self.E * (Bx - arctan(Bx)))

    def sine(self, x):
        return self.D * sin(self.inner(x))

    def cosine(self, x):
        return self.D * cos(self.inner(x))


def version_61(T, p, p0, Fz, kappa, alpha, gamma, Vx, V0, R0, Fz0, *, combined=True):
    c = dict(T)
    a, g = tan(alpha), sin(gamma)
    Fz0_ = c["LFZO"] * Fz0
    dfz, dpi = (Fz - Fz0_) / Fz0_, (p - p0) / p0
    lmux_, lmuy_ = (10 * c[k] / (1 + 9 * c[k]) for k in ("LMUX", "LMUY"))
    # Fx0
    mux = (
        (c["PDX1"] + c["PDX2"] * dfz) * (1 + c["PPX3"] * dpi + c["PPX4"] * dpi**2) * (1 - c["PDX3"] * g**2) * c["LMUX"]
    )
    Kx = (
        Fz
        * (c["PKX1"] + c["PKX2"] * dfz)
        * exp(c["PKX3"] * dfz)
        * (1 + c["PPX1"] * dpi + c["PPX2"] * dpi**2)
        * c["LKX"]
    )
    SHx = (c["PHX1"] + c["PHX2"] * dfz) * c["LHX"]
    SVx = Fz * (c["PVX1"] + c["PVX2"] * dfz) * c["LVX"] * lmux_
    Cx = c["PCX1"] * c["LCX"]
    kx = kappa + SHx
    Ex = (c["PEX1"] + c["PEX2"] * dfz + c["PEX3"] * dfz**2) * (1 - c["PEX4"] * sign(kx)) * c["LEX"]
    Fx0 = Curve(Kx / (Cx * mux * Fz), Cx, mux * Fz, Ex).sine(kx) + SVx
    # Fy0

    def Fy_pure(g):
        muy = (c["PDY1"] + c["PDY2"] * dfz) * (1 + c["PPY3"] * dpi + c["PPY4"] * dpi**2) * (1 - c["PDY3"] * g**2)
        muy *= c["LMUY"]
        Ky = c["PKY1"] * Fz0_ * (1 + c["PPY1"] * dpi) * (1 - c["PKY3"] * abs(g))
        Ky *= sin(c["PKY4"] * arctan(Fz / Fz0_ / ((c["PKY2"] + c["PKY5"] * g**2) * (1 + c["PPY2"] * dpi)))) * c["LKY"]
        SVyg = Fz * (c["PVY3"] + c["PVY4"] * dfz) * g * c["LKYC"] * lmuy_
        Kyg0 = Fz * (c["PKY6"] + c["PKY7"] * dfz) * (1 + c["PPY5"] * dpi) * c["LKYC"]
        SHy = (c["PHY1"] + c["PHY2"] * dfz) * c["LHY"] + (Kyg0 * g - SVyg) / Ky
        SVy = Fz * (c["PVY1"] + c["PVY2"] * dfz) * c["LVY"] * lmuy_ + SVyg
        Cy = c["PCY1"] * c["LCY"]
        ay = a + SHy
        Ey = (c["PEY1"] + c["PEY2"] * dfz) * (1 + c["PEY5"] * g**2 - (c["PEY3"] + c["PEY4"] * g) * sign(ay)) * c["LEY"]
        By = Ky / (Cy * muy * Fz)
        return Curve(By, Cy, muy * Fz, Ey).sine(ay) + SVy, muy, Ky, SHy, SVy, By, Cy

    Fy0, muy, Ky, SHy, SVy, By, Cy = Fy_pure(g)
    Fy0_upright = Fy_pure(0.0)[0]
    # combined
    Gxa, Gyk, SVyk = 1.0, 1.0, 0.0
    if combined:
        Bxa = (c["RBX1"] + c["RBX3"] * g**2) * cos(arctan(c["RBX2"] * kappa)) * c["LXAL"]
        xa = Curve(Bxa, c["RCX1"], 1.0, c["REX1"] + c["REX2"] * dfz)
        Gxa = xa.cosine(a + c["RHX1"]) / xa.cosine(c["RHX1"])
        Byk = (c["RBY1"] + c["RBY4"] * g**2) * cos(arctan(c["RBY2"] * (a - c["RBY3"]))) * c["LYKA"]
        yk = Curve(Byk, c["RCY1"], 1.0, c["REY1"] + c["REY2"] * dfz)
        SHyk = c["RHY1"] + c["RHY2"] * dfz
        Gyk = yk.cosine(kappa + SHyk) / yk.cosine(SHyk)
        DVyk = muy * Fz * (c["RVY1"] + c["RVY2"] * dfz + c["RVY3"] * g) * cos(arctan(c["RVY4"] * a))
        SVyk = DVyk * sin(c["RVY5"] * arctan(c["RVY6"] * kappa)) * c["LVYKA"]
    Fx, Fy = Gxa * Fx0, Gyk * Fy0 + SVyk
    # Mz
    SHt = c["QHZ1"] + c["QHZ2"] * dfz + (c["QHZ3"] + c["QHZ4"] * dfz) * g
    at, ar = a + SHt, a + SHy + SVy / Ky
    if combined:
        at = sqrt(at**2 + (Kx / Ky) ** 2 * kappa**2) * sign(at)
        ar = sqrt(ar**2 + (Kx / Ky) ** 2 * kappa**2) * sign(ar)
    Bt = (
        (c["QBZ1"] + c["QBZ2"] * dfz + c["QBZ3"] * dfz**2)
        * (1 + c["QBZ4"] * g + c["QBZ5"] * abs(g))
        * c["LKY"]
        / c["LMUY"]
    )
    Ct = c["QCZ1"]
    Dt = Fz * (R0 / Fz0_) * (c["QDZ1"] + c["QDZ2"] * dfz) * (1 - c["PPZ1"] * dpi) * c["LTR"]
    Dt *= 1 + c["QDZ3"] * abs(g) + c["QDZ4"] * g**2
    Et = c["QEZ1"] + c["QEZ2"] * dfz + c["QEZ3"] * dfz**2
    Et *= 1 + (c["QEZ4"] + c["QEZ5"] * g) * (2 / pi) * arctan(Bt * Ct * at)
    t = Curve(Bt, Ct, Dt, Et).cosine(at) * cos(alpha)
    Br = c["QBZ9"] * c["LKY"] / c["LMUY"] + c["QBZ10"] * By * Cy
    camber = (c["QDZ8"] + c["QDZ9"] * dfz) * (1 + c["PPZ2"] * dpi) + (c["QDZ10"] + c["QDZ11"] * dfz) * abs(g)
    Dr = Fz * R0 * ((c["QDZ6"] + c["QDZ7"] * dfz) * c["LRES"] + camber * g * c["LKZC"]) * c["LMUY"] * cos(alpha)
    s = R0 * (c["SSZ1"] + c["SSZ2"] * Fy / Fz0_ + (c["SSZ3"] + c["SSZ4"] * dfz) * g) * c["LS"]
    Mz = -t * Gyk * Fy0_upright + Dr * cos(arctan(Br * ar)) + s * Fx
    # Mx, My
    Mx = c["QSX1"] * c["LVMX"] - c["QSX2"] * gamma * (1 + c["PPMX1"] * dpi) + c["QSX3"] * Fy / Fz0
    Mx += (
        c["QSX4"]
        * cos(c["QSX5"] * arctan(c["QSX6"] * Fz / Fz0) ** 2)
        * sin(c["QSX7"] * gamma + c["QSX8"] * arctan(c["QSX9"] * Fy / Fz0))
    )
    Mx += c["QSX10"] * arctan(c["QSX11"] * Fz / Fz0) * gamma
    My = c["QSY1"] + c["QSY2"] * Fx / Fz0 + c["QSY3"] * abs(Vx / V0) + c["QSY4"] * (Vx / V0) ** 4
    My += (c["QSY5"] + c["QSY6"] * Fz / Fz0) * gamma**2
    My *= R0 * Fz0 * (Fz / Fz0) ** c["QSY7"] * (p / p0) ** c["QSY8"] * c["LMY"]
    return np.array([Fx, Fy, R0 * Fz * Mx * c["LMX"], My, Mz]), (mux, Kx, muy, Ky)


def version_52(T, Fz, kappa, alpha, gamma, Vx, V0, R0, Fz0, *, combined=True):
    c = dict(T)
    Fz0_ = c["LFZO"] * Fz0
    dfz = (Fz - Fz0_) / Fz0_
    gx, gy, gz = gamma * c["LGAX"], gamma * c["LGAY"], gamma * c["LGAZ"]
    mux = (c["PDX1"] + c["PDX2"] * dfz) * (1 - c["PDX3"] * gx**2) * c["LMUX"]
    Kx = Fz * (c["PKX1"] + c["PKX2"] * dfz) * exp(c["PKX3"] * dfz) * c["LKX"]
    SHx, SVx = (c["PHX1"] + c["PHX2"] * dfz) * c["LHX"], Fz * (c["PVX1"] + c["PVX2"] * dfz) * c["LVX"] * c["LMUX"]
    kx, Cx = kappa + SHx, c["PCX1"] * c["LCX"]
    Ex = (c["PEX1"] + c["PEX2"] * dfz + c["PEX3"] * dfz**2) * (1 - c["PEX4"] * sign(kx)) * c["LEX"]
    Fx0 = Curve(Kx / (Cx * mux * Fz), Cx, mux * Fz, Ex).sine(kx) + SVx
    muy = (c["PDY1"] + c["PDY2"] * dfz) * (1 - c["PDY3"] * gy**2) * c["LMUY"]
    Ky = c["PKY1"] * Fz0 * sin(2 * arctan(Fz / (c["PKY2"] * Fz0 * c["LFZO"]))) * (1 - c["PKY3"] * abs(gy))
    Ky *= c["LFZO"] * c["LKY"]
    SHy = (c["PHY1"] + c["PHY2"] * dfz + c["PHY3"] * gy) * c["LHY"]
    SVy = Fz * ((c["PVY1"] + c["PVY2"] * dfz) + (c["PVY3"] + c["PVY4"] * dfz) * gy) * c["LVY"] * c["LMUY"]
    ay, Cy = alpha + SHy, c["PCY1"] * c["LCY"]
    Ey = (c["PEY1"] + c["PEY2"] * dfz) * (1 - (c["PEY3"] + c["PEY4"] * gy) * sign(ay)) * c["LEY"]
    By = Ky / (Cy * muy * Fz)
    Fy0 = Curve(By, Cy, muy * Fz, Ey).sine(ay) + SVy
    Gxa, Gyk, SVyk = 1.0, 1.0, 0.0
    if combined:
        xa = Curve(c["RBX1"] * cos(arctan(c["RBX2"] * kappa)) * c["LXAL"], c["RCX1"], 1.0, c["REX1"] + c["REX2"] * dfz)
        Gxa = xa.cosine(alpha + c["RHX1"]) / xa.cosine(c["RHX1"])
        B = c["RBY1"] * cos(arctan(c["RBY2"] * (alpha - c["RBY3"]))) * c["LYKA"]
        yk = Curve(B, c["RCY1"], 1.0, c["REY1"] + c["REY2"] * dfz)
        SHyk = c["RHY1"] + c["RHY2"] * dfz
        Gyk = yk.cosine(kappa + SHyk) / yk.cosine(SHyk)
        DVyk = muy * Fz * (c["RVY1"] + c["RVY2"] * dfz + c["RVY3"] * gamma) * cos(arctan(c["RVY4"] * alpha))
        SVyk = DVyk * sin(c["RVY5"] * arctan(c["RVY6"] * kappa)) * c["LVYKA"]
    Fx, Fy = Gxa * Fx0, Gyk * Fy0 + SVyk
    at = alpha + c["QHZ1"] + c["QHZ2"] * dfz + (c["QHZ3"] + c["QHZ4"] * dfz) * gz
    ar = alpha + SHy + SVy / Ky
    if combined:
        at = arctan(sqrt(tan(at) ** 2 + (Kx / Ky) ** 2 * kappa**2)) * sign(at)
        ar = arctan(sqrt(tan(ar) ** 2 + (Kx / Ky) ** 2 * kappa**2)) * sign(ar)
    Bt = (c["QBZ1"] + c["QBZ2"] * dfz + c["QBZ3"] * dfz**2) * (1 + c["QBZ4"] * gz + c["QBZ5"] * abs(gz))
    Bt *= c["LKY"] / c["LMUY"]
    Dt = Fz * (c["QDZ1"] + c["QDZ2"] * dfz) * (1 + c["QDZ3"] * gz + c["QDZ4"] * gz**2) * (R0 / Fz0_) * c["LTR"]
    Et = c["QEZ1"] + c["QEZ2"] * dfz + c["QEZ3"] * dfz**2
    Et *= 1 + (c["QEZ4"] + c["QEZ5"] * gz) * (2 / pi) * arctan(Bt * c["QCZ1"] * at)
    t = Curve(Bt, c["QCZ1"], Dt, Et).cosine(at) * cos(alpha)
    Br = c["QBZ9"] * c["LKY"] / c["LMUY"] + c["QBZ10"] * By * Cy
    Dr = Fz * R0 * ((c["QDZ6"] + c["QDZ7"] * dfz) * c["LRES"] + (c["QDZ8"] + c["QDZ9"] * dfz) * gz) * c["LMUY"]
    s = R0 * (c["SSZ1"] + c["SSZ2"] * Fy / Fz0_ + (c["SSZ3"] + c["SSZ4"] * dfz) * gz) * c["LS"]
    Mz = -t * (Fy - SVyk) + Dr * cos(arctan(Br * ar)) * cos(alpha) + s * Fx
    Mx = R0 * Fz * (c["QSX1"] * c["LVMX"] - c["QSX2"] * gamma + c["QSX3"] * Fy / Fz0) * c["LMX"]
    My = c["QSY1"] + c["QSY2"] * Fx / Fz0 + c["QSY3"] * abs(Vx / V0) + c["QSY4"] * (Vx / V0) ** 4
    return np.array([Fx, Fy, Mx, R0 * Fz * My * c["LMY"], Mz]), (mux, Kx, muy, Ky)

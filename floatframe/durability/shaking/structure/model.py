"""A structure on moving bases, in its modes with fixed bases.

    eta_ddot + C eta_dot + diag(omega²) eta = B_0 s + B_1 s_dot + B_2 s_ddot
    y = Σ_r E_r d^r eta/dt^r + D_r d^r s/dt^r,  r = 0, 1, 2

An input is the r-th derivative of its s: r = 2 for the acceleration of a base, whose displacement is s; r = 0 for a
force. There is no large mass on the base: s is prescribed, and the force that moves the base is an output
(docs/shake.md).
"""

from dataclasses import dataclass, field, replace

import numpy as np

from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.units import Units
from floatframe.errors import ModelError

__all__ = [
    "DIRECTIONS",
    "Base",
    "Output",
    "ShakenModel",
    "gravity_in",
    "modal_response",
    "response",
    "rigid_rows",
]

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")  #: directions of a base, in its own axes
STANDARD_GRAVITY = 9.80665  #: [m/s²], exact by definition (ISO 80000-3)


@dataclass(frozen=True, eq=False)
class Base:
    """A rigid base: the parts that it holds, and its reference point for rotations and moments."""

    name: str
    holds: tuple[str, ...]  #: interfaces of a body, or joints and springs of a system, that the base moves
    point: Array  #: reference point in coordinates of the mesh, or of the ground, (3,) [m]
    axes: Array = field(default_factory=lambda: np.eye(3))  #: axes of the base directions as columns, (3, 3)

    def __post_init__(self) -> None:
        for name in ("point", "axes"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


@dataclass(frozen=True)
class Output:
    """The description of an output."""

    name: str  #: name of the place and component: "mirror x", "base force z"
    kind: str  #: "acceleration", "angular acceleration", "displacement", "rotation", "force", "moment", "stress", ...
    unit: str  #: in units of the model
    group: str  #: the place; all rows of one place have the same group
    place: str = ""  #: description of the place, with ids


@dataclass(frozen=True, eq=False)
class ShakenModel:
    """Modes with fixed bases, their excitation by the inputs, and the outputs."""

    name: str
    units: Units
    bases: tuple[Base, ...]
    inputs: tuple[str, ...]  #: "base:x" of a base, otherwise the name of a force
    rates: IntArray  #: order r of the derivative that is the input, for each input, (n_s,)
    omega: Array  #: ascending angular frequencies, (n_m,) [rad per unit of time]
    C: Array  #: modal damping, (n_m, n_m) [1/unit of time]
    B: Array  #: (3, n_m, n_s)
    E: Array  #: (3, n_out, n_m)
    D: Array  #: (3, n_out, n_s)
    outputs: tuple[Output, ...]
    mass: Array  #: rigid mass matrix about the points of the bases, (6 n_bases, 6 n_bases)
    #: stress of the modes and of s at the kept nodes, then at the stress points, xx yy zz yz xz xy, (n, 6, n_m) and
    #: (n, 6, n_s); None: no stress modes
    field: tuple[Array, Array] | None = None
    field_labels: tuple[str, ...] = ()  #: names of those nodes and points
    n_residual: int = 0  #: number of modes that respond statically; they are the last ones
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("omega", "C", "B", "E", "D", "mass"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        object.__setattr__(self, "rates", frozen(self.rates, np.int64))
        n_m, n_s, n_out = len(self.omega), len(self.inputs), len(self.outputs)
        for name, shape in {"C": (n_m, n_m), "B": (3, n_m, n_s), "E": (3, n_out, n_m), "D": (3, n_out, n_s)}.items():
            if getattr(self, name).shape != shape:
                raise ModelError(f"shake: {name}: expected {shape}, got {getattr(self, name).shape}")

    @property
    def frequencies(self) -> Array:
        """Natural frequencies with fixed bases, (n_m,) [Hz]."""
        return np.asarray(self.omega / (2 * np.pi) / self.units.time)

    @property
    def damping_ratios(self) -> Array:
        """Diagonal of C divided by 2 omega, (n_m,)."""
        return np.asarray(np.diag(self.C) / (2 * self.omega))

    @property
    def is_modal(self) -> bool:
        """Whether the damping does not couple modes."""
        return not (self.C - np.diag(np.diag(self.C))).any()

    @property
    def gravity(self) -> float:
        """One g in units of the model [length/time²]."""
        return gravity_in(self.units)

    def output_index(self, name: str) -> int:
        """Return the row of an output; `ModelError` with the nearest name if there is none."""
        from fe_models.foundation.words import nearest, quoted

        names = [output.name for output in self.outputs]
        if name not in names:
            raise ModelError(f"shake: no output {quoted(name)}{nearest(name, names)}")
        return names.index(name)

    def with_frequencies(self, factor: float) -> "ShakenModel":
        """Return the model with another stiffness: all frequencies times a factor, with the same damping ratios.

        Coefficients of stiffness are multiplied by factor², those of damping by factor: in the forces and stresses due
        to displacements and velocities, and in the excitation of modes by the base. The result is then the same whether
        forces are written with displacements or with accelerations.
        """
        stiffer = factor ** np.array([2.0, 1.0, 0.0])[:, None, None]
        by_output = np.where([follows_stiffness(each) for each in self.outputs], stiffer[:, :, 0], 1.0)[:, :, None]
        by_input = np.where(self.rates > 0, stiffer[:, :, 0], 1.0)[:, None, :]
        D = self.D * np.where(self.rates > 0, by_output, 1.0)
        return replace(self, omega=self.omega * factor, C=self.C * factor, B=self.B * by_input,
                       E=self.E * by_output, D=D)  # fmt: skip


def follows_stiffness(output: Output) -> bool:
    """Whether an output depends on displacements through a stiffness: forces, stresses, accelerations from forces."""
    return any(word in output.kind for word in ("force", "moment", "stress", "acceleration"))


def gravity_in(units: Units) -> float:
    """Return one g in a unit system, 9.80665 m/s² exactly [length/time²]."""
    return STANDARD_GRAVITY / units.to_si(length=1, time=-2)


def rigid_rows(point: Array, base: Base) -> Array:
    """Return the motion of a point (translation, rotation; common axes) with a base, (6, 6).

    u = d + theta × (p - p_0), d and theta in the axes of the base.
    """
    x, y, z = np.asarray(point) - base.point
    arm = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
    rows = np.block([[np.eye(3), arm], [np.zeros((3, 3)), np.eye(3)]])
    turn = np.zeros((6, 6))
    turn[:3, :3] = turn[3:, 3:] = base.axes
    return np.asarray(rows @ turn)


def response(model: ShakenModel, frequencies: Array) -> Array:
    """Return the outputs for inputs exp(i omega t), (n_f, n_out, n_s) complex; frequencies in Hz, above 0."""
    eta, omega = modal_response(model, frequencies)
    ones = np.ones_like(omega)
    H = sum(
        np.einsum("f,ok,fks->fos", factor, E, eta, optimize=True)
        for factor, E in zip((ones, 1j * omega, -(omega**2)), moving(model), strict=True)
        if E.any()
    )
    return np.asarray(H + driven(model.D, model.rates, omega))


def moving(model: ShakenModel) -> Array:
    """Return E without the rates of modes that respond statically, (3, n_out, n_m)."""
    if not model.n_residual:
        return model.E
    E = np.array(model.E)
    E[1:, :, len(model.omega) - model.n_residual :] = 0.0
    return E


def modal_response(model: ShakenModel, frequencies: Array) -> tuple[Array, Array]:
    """Return eta for inputs exp(i omega t), (n_f, n_m, n_s), and omega, (n_f,) [rad per unit of time]."""
    omega = 2 * np.pi * np.asarray(frequencies, dtype=float) * model.units.time
    load = driven(model.B, model.rates, omega)
    n_d = len(model.omega) - model.n_residual
    eta = np.empty_like(load)
    eta[:, n_d:] = load[:, n_d:] / model.omega[n_d:, None] ** 2
    own, C = model.omega[:n_d], model.C[:n_d, :n_d]
    if model.is_modal:
        impedance = own**2 - omega[:, None] ** 2 + 1j * omega[:, None] * np.diag(C)
        eta[:, :n_d] = load[:, :n_d] / impedance[:, :, None]
    else:
        for k, w in enumerate(omega):
            eta[k, :n_d] = np.linalg.solve(np.diag(own**2 - w**2) + 1j * w * C, load[k, :n_d])
    return eta, omega


def driven(by_rate: Array, rates: IntArray, omega: Array) -> Array:
    """Return Σ_r A_r (i omega)^(r - r_input), (n_f, rows, n_s), of matrices A (3, rows, n_s)."""
    total = np.zeros((len(omega), *by_rate.shape[1:]), complex)
    for r in range(3):
        for k, rate in enumerate(rates):
            if by_rate[r, :, k].any():
                total[:, :, k] += (1j * omega[:, None]) ** (r - int(rate)) * by_rate[r, :, k]
    return total

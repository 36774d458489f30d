"""One mode set with one number of modes, judged in small coordinates against the full model."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.arrays import Array
from cms.compare.coordinates import Coordinates
from cms.compare.free_shapes import FreeShapes
from cms.compare.full_model import FullModel
from cms.compare.pulse import Motion
from cms.compare.response import Response, interface_response
from cms.quality.record import QualityRecord, information, judge

__all__ = ["Reference", "judge_subset"]

ZERO_SHAPE = 1e-9  #: displacement of the interfaces, of a unit shape, below which they are held


@dataclass(frozen=True, eq=False)
class Reference:
    """What every subset is judged by; the same for all sets."""

    full: FullModel
    motion: Motion
    response: Response  #: of the full model at the interfaces
    hertz: float  #: Hz of one cycle per time unit of the body


def judge_subset(reference: Reference, c: Coordinates, shapes: FreeShapes, dropped: tuple[str, ...]) -> tuple[
    QualityRecord, ...
]:  # fmt: skip
    """Return the records of a subset: frequencies, shapes, statics, response, motion, mass, bound, columns."""
    parts = reference.full.parts
    targets = {name: c.reference[:, part] for name, part in parts.items()}
    return (
        frequency_record(reference, shapes),
        shape_record(reference, c, shapes, targets["Phi"]),
        static_record("static-interface", "interface load", c, shapes, targets["Psi_A"]),
        static_record("static-inertia", "rigid-body acceleration", c, shapes, targets["Psi_H"]),
        response_record(reference, c, shapes, targets["rigid"]),
        motion_record(reference, c, shapes, targets),
        mass_record(reference, c, shapes, targets["directions"]),
        condition_record(shapes),
        dropped_record(dropped),
    )


def frequency_record(reference: Reference, shapes: FreeShapes) -> QualityRecord:
    """Error of the elastic free frequencies in the band, in their order: bounds from above (Rayleigh-Ritz)."""
    full, n = reference.full, reference.full.n_band
    exact = full.frequencies[:n]
    found = np.full(n, np.nan)
    count = min(n, len(shapes.omega2))
    found[:count] = np.sqrt(np.maximum(shapes.omega2[:count], 0.0)) / (2 * np.pi)
    error = found / exact - 1
    data = {
        "frequencies_hz": found * reference.hertz,
        "errors": error,
        "mean": float(np.abs(np.where(np.isnan(error), 1.0, error)).mean()),
    }
    if count < n:
        reason = f"it has only {count} elastic frequencies; the band holds {n}"
        return judge("frequency-error", np.inf, reason, data)
    worst = int(np.abs(error).argmax())
    reason = f"largest at mode {worst + 1} ({exact[worst] * reference.hertz:.5g} Hz): {error[worst]:+.2%}"
    return judge("frequency-error", float(np.abs(error).max()), reason, data)


def shape_record(reference: Reference, c: Coordinates, shapes: FreeShapes, Phi: Array) -> QualityRecord:
    """Mass-weighted MAC of the free modes in the band with those of the subset; each takes its best partner."""
    n = reference.full.n_band
    exact = Phi[:, :n]
    found = shapes.shapes[:, : n + 10]
    mac = (exact.T @ c.M @ found) ** 2
    mac /= np.einsum("nk,nk->k", exact, c.M @ exact)[:, None]
    mac /= np.einsum("nk,nk->k", found, c.M @ found)[None, :]
    missing = 1 - mac.max(axis=1, initial=0.0)
    worst = int(missing.argmax())
    reason = f"least alike is mode {worst + 1}: MAC {1 - missing[worst]:.4f}"
    return judge("mac", float(max(missing[worst], 0.0)), reason, {"mac": mac, "missing": missing})


def static_record(name: str, load: str, c: Coordinates, shapes: FreeShapes, targets: Array) -> QualityRecord:
    """Part of static responses outside the span, in the energy norm: the error of the reduced static response."""
    elastic = np.hstack([shapes.shapes / np.sqrt(shapes.omega2), shapes.static])
    left = targets - elastic @ (elastic.T @ (c.K @ targets))
    size = np.einsum("nk,nk->k", targets, c.K @ targets)
    rest = np.einsum("nk,nk->k", left, c.K @ left)
    is_loaded = size > 1e-24 * size.max(initial=0.0)
    errors = np.sqrt(np.maximum(rest[is_loaded], 0.0) / size[is_loaded])
    if not len(errors):
        return information(name, f"no {load} deforms the body")
    return judge(name, float(errors.max()), f"largest of {len(errors)} {load}s: {errors.max():.2g}", {"errors": errors})


def response_record(reference: Reference, c: Coordinates, shapes: FreeShapes, rigid: Array) -> QualityRecord:
    """Frequency response at the interfaces against the full model's, at every frequency of the band."""
    exact = reference.response
    rows = c.at_b[exact.dofs]
    H = interface_response(
        exact.omega, rows @ rigid, rows @ shapes.shapes, shapes.omega2,
        rows @ shapes.static @ (rows @ shapes.static).T, exact.damping,
    )  # fmt: skip
    errors = exact.distance(H)
    worst = int(errors.argmax())
    f = exact.omega / (2 * np.pi) * reference.hertz
    reason = f"mean over the band {errors.mean():.2g}, largest {errors[worst]:.2g} at {f[worst]:.4g} Hz"
    data = {"errors": errors, "magnitude": exact.drawn(H), "largest": float(errors[worst])}
    return judge("frequency-response", float(errors.mean()), reason, data)


def motion_record(reference: Reference, c: Coordinates, shapes: FreeShapes, targets: dict[str, Array]) -> QualityRecord:
    """Deformation error epsilon(t) of the pulse response in the K, M and nodal norm (THEORY §8)."""
    motion = reference.motion
    s = targets["Phi"] @ motion.modes + targets["u_pulse"] @ motion.static
    data: dict[str, Array | float] = {}
    for norm, A in (("K", c.K), ("M", c.M), ("nodal", c.nodal)):
        data[f"epsilon_{norm}"] = deformation_error(s, shapes.span, A)
    largest = {norm: float(data[f"epsilon_{norm}"].max()) for norm in ("K", "M", "nodal")}  # type: ignore[union-attr]
    when = motion.t[int(np.argmax(data["epsilon_K"]))]
    reason = (
        f"largest {largest['K']:.2g} in energy (at {when:.3g} of the body's time unit), {largest['M']:.2g} in mass, "
        f"{largest['nodal']:.2g} at the nodes"
    )
    data |= {f"largest_{norm}": value for norm, value in largest.items()}
    return judge("deformation-error", largest["K"], reason, data)


def deformation_error(s: Array, span: Array, A: Array) -> Array:
    """Return min over x of |s - span x|_A / max_t |s|_A for every column of s, (n_t,).

    The directions without A-length (rigid-body motion in the K-norm) are left out of the span by their size.
    """
    G = span.T @ A @ span
    values, vectors = la.eigh((G + G.T) / 2)
    is_seen = values > 1e-13 * values.max(initial=0.0)
    B = span @ (vectors[:, is_seen] / np.sqrt(values[is_seen]))
    left = s - B @ (B.T @ (A @ s))
    left -= B @ (B.T @ (A @ left))
    size = np.sqrt(np.maximum(np.einsum("nt,nt->t", s, A @ s), 0.0))
    rest = np.sqrt(np.maximum(np.einsum("nt,nt->t", left, A @ left), 0.0))
    return np.asarray(rest / (size.max() or 1.0))


def mass_record(reference: Reference, c: Coordinates, shapes: FreeShapes, directions: Array) -> QualityRecord:
    """Effective mass of the subset's shapes with the interfaces held, against all fixed-interface modes."""
    full = reference.full
    B = shapes.span
    at_b = c.at_b @ B
    _, sizes, Vt = la.svd(at_b)
    rank = int((sizes > ZERO_SHAPE * sizes.max(initial=0.0)).sum())
    held = B @ Vt[rank:].T
    carried = np.zeros(6)
    if held.shape[1]:
        G_M = held.T @ c.M @ held
        values, vectors = la.eigh((G_M + G_M.T) / 2)
        has_mass = values > 1e-12 * values.max(initial=0.0)
        participation = (vectors[:, has_mass] / np.sqrt(values[has_mass])).T @ held.T @ c.M @ directions
        carried = (participation**2).sum(axis=0)
    has_mass = full.held_mass > 1e-12 * full.mass
    remainder = np.where(has_mass, 1 - carried / np.where(has_mass, full.held_mass, 1.0), 0.0)
    names = ("x", "y", "z", "about x", "about y", "about z")
    worst = int(remainder.argmax())
    reason = f"most is missing {'along' if worst < 3 else ''} {names[worst]}".replace("  ", " ")
    data = {"carried": carried, "remainder": remainder}
    return judge("effective-mass", float(max(remainder[worst], 0.0)), f"{reason}: {remainder[worst]:.1%}", data)


def condition_record(shapes: FreeShapes) -> QualityRecord:
    """Condition of the independent columns at unit length in the norm of K + omega_1² M."""
    return judge("conditioning", shapes.condition, f"condition {shapes.condition:.2g} of the columns that are kept")


def dropped_record(dropped: tuple[str, ...]) -> QualityRecord:
    """Columns that depend on others."""
    reason = f"{len(dropped)}: {', '.join(dropped)}" if dropped else "all columns are independent"
    return judge("dropped-columns", float(len(dropped)), reason, {"labels": "; ".join(dropped)})

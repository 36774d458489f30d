"""Random motions at coarse steps against fine ones: a motion that is wrong by more than 5 % has to say so.

(1) the case is run as drawn (`random_motion`), in chunks where it says so
(2) the reference is the same system in fine steps, absolute and relative, with steps halved until both agree
(3) the error is that of frame origins and centres of mass over the farthest way of one in any fine step, or that of
    rotations over theirs; a way of less than 0.1 um is rest for systems of about 1 m
(4) a note of the run about its steps or energy, or an error in words, is an answer; else the motion has to be right,
    unless it is chaotic: a fine run whose velocities begin 1e-6 away ends more than `CHAOS` times as far away
"""

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np

import floatframe as ff
from floatframe.model.rotations import rotation_matrix
from tests.campaign.random_motions import MotionCase, finer, random_motion
from tests.campaign.verdict import ACCEPTED, REFUSED, TRACEBACK, WRONG, Verdict

__all__ = ["motion_case", "motion_verdict"]

WRONG_BY = 0.05  #: of the motion
CALM = 0.01  #: of the motion: below, a note is needless
AGREED = 0.004  #: of the motion, between references
REST = 1e-7  #: way below which a system of about 1 m is at rest [m]
COARSEST, FINEST = 8, 256  #: steps of the reference in one of the case
MOST_STEPS = 40_000  #: of a reference
CHAOS = 30.0  #: growth of a difference in a run
SAMPLES = 60  #: times that are compared


def motion_case(seed: int, folder: Path) -> Verdict:
    """Return the verdict of the case of a seed."""
    return motion_verdict(random_motion(seed))


def motion_verdict(case: MotionCase) -> Verdict:
    """Return what became of a case."""
    logging.disable(logging.WARNING)
    try:
        try:
            motion, notes = run(case, 1)
        except ff.errors.FloatframeError as error:
            return Verdict(REFUSED, f"{type(error).__name__}: {str(error)[:300]}; {case.words}")
        reference = reference_of(case)
        if reference is None:
            return Verdict(ACCEPTED, f"no reference: {case.words}")
        error = difference(motion, reference)
        told = f"error {100 * error:.2g} %"
        if notes:
            kind = "noted" if error > CALM else "noted though right"
            return Verdict(ACCEPTED, f"{kind}: {told}, {'; '.join(note.words for note in notes)[:300]}; {case.words}")
        if error <= WRONG_BY:
            return Verdict(ACCEPTED, f"right: {told}; {case.words}")
        growth = growth_of(case)
        if growth > CHAOS:
            return Verdict(ACCEPTED, f"chaotic: {told}, growth {growth:.2g}; {case.words}")
        return Verdict(WRONG, f"silent: {told}, growth {growth:.2g}; {case.words}")
    except ff.errors.FloatframeError as error:
        return Verdict(TRACEBACK, f"the reference failed: {type(error).__name__}: {str(error)[:300]}; {case.words}")
    finally:
        logging.disable(logging.NOTSET)


class Samples:
    """Places and rotations of bodies at the times that are compared; how far they go in between too.

    The centre of mass counts beside the frame origin, which may lie in a hinge about which the body turns.
    """

    def __init__(self, system: ff.System, parts: list[ff.Trajectory], every: int) -> None:
        names = [body.name for body in system.bodies]
        origins = np.stack([joined([p.body(n).r for p in parts]) for n in names])  # (n_b, n_t, 3)
        p = np.stack([joined([p.body(n).p for p in parts]) for n in names])
        arms = np.einsum("itab,ib->ita", rotation_matrix(p), [center_of_mass(body) for body in system.bodies])
        r = np.concatenate([origins, origins + arms])  # (2 n_b, n_t, 3)
        rest = REST / system.units.to_si(length=1)
        self.way = max(rest, np.linalg.norm(r - r[:, :1], axis=2).max())
        self.angle = 2 * np.arccos(np.clip(np.abs(np.einsum("itk,itk->it", p, p[:, :1])), 0, 1)).max()
        self.r, self.p = r[:, ::every], p[:, ::every]


def center_of_mass(body: ff.RigidBody | ff.FlexibleBody) -> np.ndarray:
    """Return the centre of mass of an undeformed body in its frame."""
    if isinstance(body, ff.FlexibleBody):
        return np.asarray(body.reduced.moments.center_of_mass)
    return np.asarray(body.center_of_mass)


def joined(parts: list[np.ndarray]) -> np.ndarray:
    """Return rows of runs that follow each other; each begins with the last row of the one before."""
    return np.concatenate([parts[0], *(part[1:] for part in parts[1:])])


def run(case: MotionCase, finer_by: int, watch: str = "stop") -> tuple[Samples, tuple[ff.results.ValidityNote, ...]]:
    """Return the motion of a case with steps divided by a number, at the times that are compared, and its notes."""
    every = max(1, case.n_steps // SAMPLES) * finer_by
    h, n = case.h / finer_by, case.n_steps * finer_by
    chunk = case.chunk or n
    parts, state, notes = [], None, ()
    for first in range(0, n, chunk):
        last = min(first + chunk, n)
        part = ff.integrate(
            case.system, case.method, last * h, h, t_start=first * h, state=state, watch=watch,
            formulation=case.formulation if isinstance(case.method, ff.GeneralizedAlpha) else None,
        )  # fmt: skip
        state = part.state(-1)
        parts.append(part)
        notes = (*notes, *(note for note in part.validity if note.kind in ("steps", "energy", "damping")))
    return Samples(case.system, parts, every), notes


def reference_of(case: MotionCase) -> Samples | None:
    """Return the motion in fine steps on which both formulations agree; None if they do not at the finest."""
    finer_by, last, formulation = COARSEST, None, "relative"
    while finer_by <= FINEST and finer_by * case.n_steps <= MOST_STEPS:
        formulation = "relative" if formulation == "absolute" else "absolute"
        try:
            made, _ = run(finer(case, formulation), finer_by, "off")
        except ff.errors.ConvergenceError:
            made = None
        if made is not None and last is not None and difference(last, made) <= AGREED:
            return made
        finer_by, last = 2 * finer_by, made
    return None


def difference(motion: Samples, reference: Samples) -> float:
    """Return the largest difference of places over the farthest way, or of rotations over theirs.

    The way of a rotation is its largest angle, or a quarter of the angle it has gone through where that is more.
    """
    n = min(motion.r.shape[1], reference.r.shape[1])
    r, p, way, angle = reference.r[:, :n], reference.p[:, :n], reference.way, reference.angle
    size = np.linalg.norm(motion.r[:, :n] - r, axis=2).max()
    apart = 2 * np.arccos(np.clip(np.abs(np.einsum("itk,itk->it", p, motion.p[:, :n])), 0, 1)).max()
    if not (np.isfinite(motion.r).all() and np.isfinite(motion.p).all()):
        return float("inf")
    turned = angle
    if angle > 3.0:
        turned = 2 * np.pi
    rotation = apart / turned if turned > 1e-3 else 0.0
    return float(max(size / way if way > 0 else 0.0, rotation))


def growth_of(case: MotionCase) -> float:
    """Return by how much a difference of the start, a small part of the velocities of the motion, grows in the run."""
    small, rng = 1e-6, np.random.default_rng(1)
    finest = finer(case, "absolute")
    start = ff.analyses.consistent_state(case.system).state
    first = ff.integrate(case.system, finest.method, case.n_steps * case.h, case.h / 32, state=start, output_every=32)
    u = start.u.copy()
    for body in first.head.bodies:
        motion = first.body(body.name)
        for at, rates in ((body.u0, motion.v), (body.u0 + 3, motion.omega_B)):
            u[at : at + 3] += small * np.abs(rates).max() * rng.normal(size=3)
    other = ff.integrate(
        case.system, finest.method, case.n_steps * case.h, case.h / 32, state=replace(start, u=u), output_every=32
    )
    every = max(1, case.n_steps // SAMPLES)
    return difference(Samples(case.system, [other], every), Samples(case.system, [first], every)) / small

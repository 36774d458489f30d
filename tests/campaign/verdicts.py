"""The judge: a sound body beside its model raises no alarm, one that is spoilt in one place does, by the right name.

(1) a random sound body (`sound_bodies`) is written, read, and checked alone and against its model
(2) a record of `JUDGED` that warns or fails is a false alarm
(3) the same body with one of `CORRUPTIONS` has to fail, in the record that the corruption names
"""

from pathlib import Path

import numpy as np

import cms
from cms.assessment.quality.of_reduction.contents import CONTENTS
from cms.assessment.quality.of_reduction.fields import leaves
from cms.assessment.quality.record import QualityRecord
from cms.assessment.quality.reduction_check import check_reduction
from cms.assessment.quality.reference.full_reference import FullReference
from cms.errors import CmsError
from fe_models.errors import FeModelsError
from tests.campaign.corruptions import CORRUPTIONS, spoilt
from tests.campaign.sound_bodies import SoundBody, sound_body
from tests.campaign.verdict import ACCEPTED, REFUSED, WRONG, Verdict

__all__ = ["JUDGED", "judged", "verdict_case"]

#: records that say whether a file is right; the others say what the mode set is good for
JUDGED = (
    *CONTENTS, "same-body", "mass-properties", "symmetry", "definiteness", "kinetic-energy", "modal-mass",
    "frame-condition", "free-frequencies", "inertia-tensor", "gram", "moments-shapes", "turned-loads", "second-order",
    "rigid-interfaces", "interface-places", "energy-shares", "labels", "recovery-motions", "recovery-forces",
    "recovery-shapes", "damping-told",
)  # fmt: skip
#: what a file that was carried to another frame is not compared in
NOT_CARRIED = ("recovery: no static", "recovery: loads")


def judged(sound: SoundBody, reduced: cms.ReducedBody, reference: FullReference) -> dict[str, QualityRecord]:
    """Return the records of a body against its model."""
    records = check_reduction(sound.body, sound.modes, reduced, reference=reference, options=sound.options)
    return {record.name: record for record in records}


def changed_fields(body: cms.ReducedBody, other: cms.ReducedBody) -> set[str]:
    """Return the paths of the fields in which two bodies differ."""
    own, others = leaves(body), leaves(other)
    return {path for path in set(own) | set(others) if not same_values(own.get(path, []), others.get(path, []))}


def same_values(a: list, b: list) -> bool:
    """Return whether two lists hold the same values."""
    return len(a) == len(b) and all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))


def verdict_case(seed: int, folder: Path) -> Verdict:
    """Return the verdict of the case of a seed."""
    rng = np.random.default_rng([seed, 1])
    try:
        sound = sound_body(seed)
    except (CmsError, FeModelsError) as error:
        return Verdict(REFUSED, f"{type(error).__name__}: {str(error)[:300]}")
    path = folder / "body.h5"
    cms.write(sound.reduced, path)
    band = 1.5 * float(sound.reduced.free_frequencies.min(initial=np.inf)) / sound.body.units.time
    with FullReference(sound.body, band=band) as reference:
        found = judged(sound, cms.read(path), reference)
        alarms = [found[name] for name in JUDGED if name in found and found[name].verdict in ("warn", "fail")]
        if alarms:
            told = "; ".join(f"{record.name} {record.value:.2g}: {record.reason}" for record in alarms)
            return Verdict(WRONG, f"false alarm: {told}; {sound.words}")
        names = list(CORRUPTIONS)
        for k in rng.permutation(len(names)).tolist():
            bad = spoilt(names[k], sound.reduced, rng)
            if bad is None or ("carried" in sound.words and names[k].startswith(NOT_CARRIED)):
                continue
            record = judged(sound, bad, reference)[CORRUPTIONS[names[k]][0]]
            if record.verdict not in ("warn", "fail"):
                moments = sound.reduced.moments
                vanishing = {"moments.C1"} if np.abs(moments.C1).max() < 1e-9 * np.sqrt(moments.m) else set()
                if changed_fields(sound.reduced, bad) <= vanishing:
                    continue  # mean axes leave nothing to compare
                return Verdict(WRONG, f"not found: {names[k]}: {record.name}: {record.reason}; {sound.words}")
            break
    is_known = found["points"].verdict == "pass"
    return Verdict(ACCEPTED, f"{'right' if is_known else 'undetermined'}: {sound.words}")

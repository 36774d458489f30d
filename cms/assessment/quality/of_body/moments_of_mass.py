"""Consistency of the moments in a file with each other and with the shapes at the kept nodes.

The moments are integrals over the mass of products of a = [1, c, phi_x, phi_y, phi_z], so their Gram matrix has no
negative eigenvalue. The file does not hold the distribution of the mass. But masses at the kept nodes with the right
sum and centre have moments of about the same direction, unless these are small. A wrong sign reverses the direction.
"""

import numpy as np

from cms.assessment.quality.of_body.identities import body_length
from cms.assessment.quality.record import QualityRecord, information, judge
from cms.body.invariants import NEGATIVITY
from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array

__all__ = ["check_gram", "check_moments_of_shapes"]

ROUNDING = 1e3 * np.finfo(float).eps  #: relative rounding error of the Gram matrix about the origin of B
ALIKE = 10.0  #: largest ratio of the negativity in another frame, or of some shapes, to the negativity of the model
LEAST_NODES = 60  #: smallest number of nodes that can represent the mass of a body
EVEN = 0.3  #: weight, relative to the second moment, of the deviation from equal masses in the fit
#: ratio between moments of nodal masses and of the file, above which the kept nodes do not represent its mass
FAR_OFF = 4.0
CLEAR = 0.1  #: moment divided by the largest possible one, above which its direction is checked


def check_gram(reduced: ReducedBody) -> QualityRecord:
    """Check that the Gram matrix of the moments about the centre of mass has no negative eigenvalue (unit diagonal)."""
    moments = reduced.moments
    if moments.missing or not moments.is_exact:
        return information("gram", "the moments are not all known, or approximate")
    c, second = moments.center_of_mass, np.diag(moments.R) - moments.S**2 / moments.m
    far = float(np.linalg.norm(c) + np.linalg.norm(reduced.frame.origin))  # integrals about the mesh origin lose digits
    offset = far / float(np.sqrt(second.max() / moments.m)) if second.max() > 0 else 0.0
    value = moments.negativity
    value = 0.0 if value < ROUNDING * (1 + offset**2) else value
    if 0 < value <= ALIKE * float(reduced.provenance.get(NEGATIVITY, 0.0)):
        return information(
            "gram",
            f"the model has inertia that no distribution of its mass has, such as bars without rotary inertia "
            f"({-value:.1e}): "
            "its moments can be checked against each other only with the model",
        )
    reason = (
        f"some combination of positions and shapes would have a negative integral of its square ({-value:.1e})"
        if value > 0
        else "the moments are integrals over one mass distribution"
    )
    return judge("gram", value, reason)


def check_moments_of_shapes(reduced: ReducedBody) -> QualityRecord:
    """Check that the moments have about the direction of moments computed from masses at the kept nodes.

    (1) find nearly equal masses that have the sum, the centre and about the second moment of the file
    (2) compute P of each mode, and S_kl without its diagonal blocks, from these masses
    (3) compute the cosine between these moments and those of the file, if both are at least `CLEAR` times the largest
        moment that the mass could have

    If the P of all modes together differ from those of the file by more than the factor `FAR_OFF`, the mass is not at
    the kept nodes (a point mass on a light frame), and there is no verdict. Ratios of sound bodies, and of bodies with
    a wrong sign, are 0.9 to 3.2.
    """
    moments, nodes = reduced.moments, np.asarray(reduced.nodes)
    if moments.missing or len(nodes) < LEAST_NODES or not reduced.n_q:
        return information("moments-shapes", "too few nodes, or moments that are not known")
    weights = masses_at_nodes(reduced)
    if weights is None:
        return information("moments-shapes", "masses at the kept nodes cannot have the centre of mass of the file")
    size = np.sqrt(moments.m) * body_length(reduced)
    c = nodes - moments.center_of_mass
    Phi = np.asarray(reduced.Phi)
    own = moments.P - np.einsum("a,bk->abk", moments.center_of_mass, moments.C1)
    made = np.einsum("i,ia,ibk->abk", weights, c, Phi, optimize=True)
    ratio = np.linalg.norm(made) / max(float(np.linalg.norm(own)), np.finfo(float).tiny)
    if not 1 / FAR_OFF < ratio < FAR_OFF:
        return information("moments-shapes", f"masses at the kept nodes have {ratio:.2g} times the moments of the file")
    found: dict[str, float] = {}
    for k, cosine in enumerate(cosines(own.reshape(9, -1) / size, made.reshape(9, -1) / size)):
        if np.isfinite(cosine):
            found[f"3C of mode {k + 1}"] = (1 - cosine) / 2
    second = np.einsum("i,iak,ibl->abkl", weights, Phi, Phi, optimize=True)
    beside = ~np.eye(3, dtype=bool)
    root = np.sqrt(reduced.n_q)
    whole = cosines(moments.S_kl[beside].reshape(-1, 1) / root, second[beside].reshape(-1, 1) / root)[0]
    if np.isfinite(whole):
        found["4C and 5C"] = (1 - whole) / 2
    if not found:
        return information("moments-shapes", "no moment is large enough to determine its direction")
    worst = max(found, key=lambda key: found[key])
    reason = f"smallest cosine to moments of masses at the kept nodes is {1 - 2 * found[worst]:.2f}, of {worst}"
    return judge("moments-shapes", found[worst], f"{reason}; {len(found)} compared", {"found": found})


def masses_at_nodes(reduced: ReducedBody) -> Array | None:
    """Return nearly equal nodal masses with the mass and centre of the file, (n,); None if one is negative.

    Nodes of the surface lie farther out than the mass, so equal masses have a second moment that is up to twice too
    large. The masses w minimise |R(w) - R|² + `EVEN` n |w - 1/n|² with the correct sum and centre; total mass and
    radius of gyration are one here. If one of the masses is negative, the fit is repeated without the second moment.
    """
    moments, n = reduced.moments, len(reduced.nodes)
    center = moments.center_of_mass
    R = moments.R / moments.m - np.outer(center, center)
    radius = np.sqrt(max(float(np.trace(R)), 0.0)) or body_length(reduced)
    c = (np.asarray(reduced.nodes) - center) / radius
    i, j = np.triu_indices(3)
    rows = np.vstack([np.ones(n), c.T, (c[:, i] * c[:, j]).T])
    wanted = np.concatenate([[1.0], np.zeros(3), R[i, j] / radius**2])
    free = np.concatenate([np.zeros(4), np.full(6, EVEN * n)])
    for k in (10, 4):
        A = rows[:k]
        y, *_ = np.linalg.lstsq(A @ A.T + np.diag(free[:k]), wanted[:k] - A.mean(axis=1), rcond=1e-12)
        weights = 1 / n + A.T @ y
        if weights.min() >= 0:
            return np.asarray(moments.m * weights)
    return None


def cosines(a: Array, b: Array) -> Array:
    """Return the cosine between columns of equal index, (k,); NaN if one of the two is shorter than `CLEAR`."""
    one, other = np.linalg.norm(a, axis=0), np.linalg.norm(b, axis=0)
    is_clear = (one > CLEAR) & (other > CLEAR)
    product = np.einsum("nk,nk->k", a, b)
    return np.divide(product, one * other, out=np.full(len(one), np.nan), where=is_clear)

"""Families whose modes cross the cutoff of the mode set between samples."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from cms.errors import BodyError
from cms.family import job_at
from cms.jobs.job import read_job
from cms.reduction import parametric_body, reduce_family
from cms.reduction.parametric.common_modes import in_common_modes
from cms.reduction.parametric.interpolation_errors import flexibility, relative
from cms.reduction.recovery.load_columns import forces_of_loads
from tests.cms.reduction.parametric.bar import BAR, THICKNESSES, N, write_job

N_MODES = 5
N_STATIC = 12  #: constraint and inertia-relief modes without rigid-body motion
JOB = (
    """
[parameters]
thickness = 0.01
[body]
nodes = "nodes.csv"
lines = "lines.csv"
units = "m-kg-s"
"""
    + BAR
    + """[load_cases.push]
kind = "force"
force = [30.0, -20.0, 10.0]
nodes = "middle"
[reduction]
set = "craig-bampton-ir"
n_modes = 5
frame = "nodal"
at = "root"
origin = [5.2, -2.9, 2.1]
axes = [[0, 0.6, 0.8], [0, -0.8, 0.6], [1, 0, 0]]
geometric_stiffness = true
[recovery.gauges]
rows = [{quantity = "displacement", at = ["middle"]}, {quantity = "beam force", at = [2]}]
[damping]
ratio = 0.02
"""
)


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    """A bent bar far from the origin, in a nodal frame with other axes: bending, torsion and stretch are coupled."""
    folder, x = tmp_path_factory.mktemp("bent"), np.linspace(0, 1, N + 1)
    nodes = np.stack([5 + x, 0.2 * x - 3 + 0.1 * x**2, 2 - 0.3 * x], axis=1)
    return write_job(folder, nodes, JOB, {3: "middle"})


def reduced(job, thickness, **changes):
    return cms.reduce_job(read_job(job, {"thickness": thickness, **changes}))


@pytest.fixture(scope="module")
def samples(job):
    return [cms.reduce_job(job_at(job, {"thickness": t})) for t in THICKNESSES]


def test_the_mode_sets_alone_span_different_spaces(job):
    """So the cases of this file do cross the cutoff."""
    sets = [reduced(job, thickness) for thickness in THICKNESSES]
    with pytest.raises(BodyError, match=r"modes have no counterpart in .* more modes beyond the cutoff"):
        parametric_body({"thickness": THICKNESSES}, sets)


def static_response(body):
    """Return q under a general wrench at the tip and a load case."""
    wrench = np.array([300.0, -200.0, 500.0, 40.0, 70.0, -60.0])
    return np.linalg.solve(body.K, body.interface("tip").Psi.T @ wrench), body.load_case("push").h


def recovered(body):
    """Return the rows of a table in equilibrium with unit loads, and with accelerations of this shape, in columns."""
    table = body.recovery["gauges"]
    q = np.linalg.solve(body.K, forces_of_loads(body, table.loads)[6:])
    D_0, D_2 = table.dynamic[0][:, 6:], table.dynamic[2][:, 6:]
    is_static = [not name.startswith(("load case", "spin")) for name in table.loads]
    shapes = q[:, is_static]  # in the span of the set
    return D_0 @ q + table.static, D_2 @ shapes - D_0 @ np.linalg.solve(body.K, shapes)


def test_samples_in_common_modes_keep_everything_that_the_mode_set_gives_exactly(job, samples):
    """The static response to interface loads is exact in both: every linear and quadratic quantity of it agrees."""
    found = in_common_modes(samples, [str(t) for t in THICKNESSES], 1)
    for thickness, body in zip(THICKNESSES, found, strict=True):
        direct = reduced(job, thickness)
        assert body.n_q > direct.n_q
        (q, h), (p, g) = static_response(body), static_response(direct)
        pairs = [
            (h @ q, g @ p),
            (q @ body.K @ q, p @ direct.K @ p),
            (body.Phi @ q, direct.Phi @ p),
            (body.kept.rotation @ q, direct.kept.rotation @ p),
            (body.stress @ q, direct.stress @ p),
            (body.interface("tip").Psi @ q, direct.interface("tip").Psi @ p),
            (body.moments.C1 @ q, direct.moments.C1 @ p),
            (body.moments.P @ q, direct.moments.P @ p),
            (np.einsum("abkl,k,l->ab", body.moments.S_kl, q, q), np.einsum("abkl,k,l->ab", direct.moments.S_kl, p, p)),
            (body.recovery["gauges"].dynamic[0][:, 6:] @ q, direct.recovery["gauges"].dynamic[0][:, 6:] @ p),
        ]
        pairs += zip(recovered(body), recovered(direct), strict=True)
        for name in ("translation", "rotation", "spin", "interfaces"):
            G, H = getattr(body.geometric, name), getattr(direct.geometric, name)
            pairs.append((np.einsum("...kl,k,l->...", G, q, q), np.einsum("...kl,k,l->...", H, p, p)))
        for value, expected in pairs:
            assert_allclose(value, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
        assert_allclose(body.D, np.diag(0.04 * 2 * np.pi * body.frequencies), rtol=1e-9, atol=1e-9 * body.D.max())
        assert_allclose(body.moments.gram, np.asarray(body.moments.gram).T, rtol=0, atol=1e-12)


def test_frequencies_of_common_modes_lie_between_those_of_the_set_and_of_the_richer_set(job, samples):
    for thickness, body in zip(THICKNESSES, in_common_modes(samples, ["a", "b", "c"], 1), strict=True):
        fewer, more = reduced(job, thickness), reduced(job, thickness, **{"reduction.n_modes": N_MODES + 4})
        for name in ("frequencies", "free_frequencies"):
            own = getattr(body, name)
            assert (own[: fewer.n_q] <= getattr(fewer, name) * (1 + 1e-9)).all()
            assert (own >= getattr(more, name)[: body.n_q] * (1 - 1e-9)).all()


@pytest.mark.parametrize("thickness", [0.0145, 0.0193, 0.0205, 0.022])
def test_a_family_with_crossings_at_the_cutoff_is_as_good_as_its_estimate(job, family, thickness):
    """In between, beside direct reductions: above the richer set and below the set, except for the stated error."""
    found, estimate = family.at(thickness=thickness), family.errors
    fewer, more = reduced(job, thickness), reduced(job, thickness, **{"reduction.n_modes": N_MODES + 4})
    for own, error, high, low in (
        (found.frequencies, estimate.frequency, fewer.frequencies, more.frequencies),
        (found.free_frequencies, estimate.free_frequency, fewer.free_frequencies, more.free_frequencies),
    ):
        n = len(high) // 2
        margin = error[: 2 * n].max()
        assert (own[:n] <= high[:n] * (1 + margin)).all()
        assert (own[:n] >= low[:n] * (1 - margin)).all()
        assert margin < 0.1
    assert relative(flexibility(found), flexibility(fewer)) <= estimate.static < 0.1


@pytest.fixture(scope="module")
def family(job):
    return reduce_family(job, {"thickness": THICKNESSES})


@pytest.mark.parametrize("chosen", ['set = "rubin"\nn_modes = 5', 'set = "craig-bampton"\ncutoff = 700.0'])
def test_static_responses_of_samples_stay_those_of_the_set(job, chosen):
    """Rubin's residual modes depend on the number of modes; below a cutoff the samples have 7, 7 and 6 modes."""
    path = job.with_name("other.toml")
    path.write_text(JOB.replace('set = "craig-bampton-ir"\nn_modes = 5', chosen))
    family = reduce_family(path, {"thickness": THICKNESSES})
    sets = [reduced(path, thickness) for thickness in THICKNESSES]
    assert {sample.n_q for sample in family.samples} == {max(each.n_q for each in sets) + ("rubin" in chosen)}
    for sample, own in zip(family.samples, sets, strict=True):
        assert (sample.frequencies[: own.n_q] <= own.frequencies * (1 + 1e-9)).all()
        assert relative(flexibility(sample), flexibility(own)) < 1e-9

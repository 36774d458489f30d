from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pydantic import ValidationError

from cms.assessment.compare.mode_selection import ESTIMATE, MEASURES, select_modes
from cms.cli.info import print_body
from cms.jobs.body_of_job import coupled_body
from cms.jobs.job import Job, ReductionSection
from cms.jobs.mode_set_of_job import job_mode_set
from cms.jobs.reduction_table import MEASURE_NAMES
from cms.modes.centrifugal import centrifugal_loads
from cms.modes.mode_sets import assumed_modes, balanced_truncation, craig_bampton, h2_optimal, krylov
from cms.modes.mode_sets.extra_columns import with_centrifugal, with_load_cases
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from fe_models.body.load_cases import LoadCase
from fe_models.foundation.units import unit_system
from tests.bodies import bar
from tests.synthetic import synthetic_reduced_body


@pytest.fixture(scope="module")
def body():
    """Time in ms: frequencies of functions are in cycles per ms, those of the job in Hz."""
    free = replace(bar(nx=4, kind="hexahedron"), units=unit_system("mm-kg-ms"))
    push = np.random.default_rng(0).normal(size=free.n_dof)
    return couple(free.with_load_cases(LoadCase("push", "force", push), *centrifugal_loads(free)))


def section(**keys):
    return ReductionSection.model_validate(keys)


def same(found, expected):
    assert found.labels == expected.labels
    assert_allclose(found.columns, expected.columns, rtol=0, atol=1e-9 * np.abs(expected.columns).max())


@pytest.mark.parametrize(
    ("keys", "direct"),
    [
        (
            {"set": "krylov", "n_blocks": 1, "shifts": [0, 3e5], "load_cases": False},
            lambda body: krylov(body, n_blocks=1, shifts=[0.0, 300.0], load_cases=False),
        ),
        (
            {"set": "krylov", "tolerance": 1e-2, "band": [0, 4e5]},
            lambda body: krylov(body, tolerance=1e-2, band=(0.0, 400.0)),
        ),
        (
            {"set": "balanced-truncation", "n_modes": 7, "damping_ratio": 0.03, "n_rich": 20},
            lambda body: balanced_truncation(body, n_modes=7, damping_ratio=0.03, n_rich=20),
        ),
        (
            {"set": "h2-optimal", "n_modes": 3, "damping_ratio": 0.03, "static": False, "inputs": ["left uz"]},
            lambda body: h2_optimal(body, n_modes=3, damping_ratio=0.03, static=False, inputs=["left uz"]),
        ),
        (
            {"set": "h2-optimal", "tolerance": 0.5, "n_rich": 20, "max_iterations": 30},
            lambda body: h2_optimal(body, tolerance=0.5, n_rich=20, max_iterations=30),
        ),
        (
            {"set": "assumed-modes", "n_modes": 3, "n_torsion": 4, "functions": "splines", "axis": [1, 0, 0]},
            lambda body: assumed_modes(body, n_modes=3, n_torsion=4, functions="splines", axis=[1.0, 0.0, 0.0]),
        ),
        (
            {"set": "craig-bampton", "n_modes": 2, "extra": ["centrifugal", "load-cases"]},
            lambda body: with_load_cases(with_centrifugal(craig_bampton(body, n_modes=2), body), body),
        ),
    ],
)
def test_a_job_makes_the_set_of_the_function(body, keys, direct):
    same(job_mode_set(body, section(**keys)), direct(body))


def test_a_job_takes_columns_from_a_file(body, tmp_path):
    modes = craig_bampton(body, n_modes=2)
    np.savez(tmp_path / "basis.npz", columns=modes.columns, labels=modes.labels)
    asked = ReductionSection.model_validate({"set": "user-basis", "columns": "basis.npz"}, context=tmp_path)
    same(job_mode_set(body, asked), modes)
    keys = {"set": "user-basis", "columns": "basis.npz", "columns_over": "coupled"}
    same(job_mode_set(body, ReductionSection.model_validate(keys, context=tmp_path)), modes)
    with pytest.raises(ValueError, match="unknown dofs; did you mean 'mesh'"):
        ReductionSection.model_validate(keys | {"columns_over": "mash"}, context=tmp_path)


def test_a_job_chooses_the_number_of_modes(body):
    found = job_mode_set(body, section(n_modes="auto", error=1e-2, band=[0, 1.5e6]))
    expected = select_modes(body, error=1e-2, band=(0.0, 1.5e6))
    same(found, expected.modes)
    assert reduce(body, found).provenance["mode set selected"] == expected.sentence


@pytest.mark.parametrize("extra", [None, ["load-cases"], ["centrifugal"]])
def test_a_job_makes_centrifugal_loads_before_it_couples_where_they_are_asked_for(tmp_path, extra):
    (tmp_path / "rod.msh").touch()
    keys = {
        "body": {"name": "bar", "mesh": "rod.msh", "units": "m-kg-s"},
        "materials": {"steel": {"young": 2.1e11, "poisson": 0.3, "density": 7850.0}},
        "reduction": {"n_modes": 1} | ({} if extra is None else {"extra": extra}),
    }
    free = bar(nx=2, kind="hexahedron")
    coupled = coupled_body(Job.model_validate(keys, context=tmp_path), free)
    names = [case.name for case in coupled.load_cases]
    assert names == ([case.name for case in centrifugal_loads(free)] if extra == ["centrifugal"] else [])


def test_the_choice_is_shown(capsys):
    chosen = "rubin: 12 modes are the fewest"
    print_body(replace(synthetic_reduced_body(), provenance={"mode set selected": chosen}))
    assert f"Selected: {chosen}" in capsys.readouterr().out


def test_a_job_reduces_interfaces_of_nodes_before_it_counts_modes():
    free = bar(nx=4, ny=2, nz=2, width=0.3, height=0.3, kind="hexahedron")
    body = couple(replace(free, interfaces=[replace(x, kind="nodes") for x in free.interfaces]))
    few = job_mode_set(body, section(n_modes=2, interface_modes=4))
    assert few.columns.shape[1] == 2 * (6 + 4) + 2
    by_cutoff = job_mode_set(body, section(n_modes=2, interface_cutoff=12_000.0, interfaces_together=True))
    assert 12 + 2 < by_cutoff.columns.shape[1] < len(body.b) + 2
    chosen = job_mode_set(body, section(n_modes="auto", error=0.05, band=[0, 3000], interface_modes=4))
    assert chosen.columns.shape[1] == 20 + int(chosen.options["n_modes"])


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"n_modes": "some"}, 'a whole number, 0 or more, of vibration modes, or "auto"'),
        ({"n_modes": "auto", "band": [0, 10]}, "needs error"),
        ({"n_modes": "auto", "error": 0.1}, "needs band"),
        ({"n_modes": 3, "error": 0.1}, 'error belongs to n_modes = "auto"; got n_modes = 3'),
        ({"n_modes": 3, "measure": "frf"}, "measure belongs to"),
        ({"n_modes": 3, "band": [0, 10]}, "has no option band"),
        ({"n_modes": "auto", "error": 0.1, "band": [0, 10], "measure": "fft"}, "unknown measure"),
        ({"n_modes": 3, "shifts": [0]}, "mode set 'craig-bampton' has no option shifts"),
        ({"set": "krylov", "n_blocks": 1, "shifts": []}, "a list of frequencies, 0 or more, in Hz"),
        ({"set": "krylov", "n_blocks": 0}, "greater than or equal to 1"),
        ({"set": "h2-optimal", "n_modes": 3, "max_iterations": 0}, "greater than or equal to 1"),
        ({"set": "rubin", "n_modes": 3, "static": False}, "mode set 'rubin' has no option static"),
        ({"n_modes": 3, "extra": ["load-case"]}, "unknown extra columns 'load-case'; did you mean 'load-cases'"),
        ({"n_modes": 3, "extra": []}, "each once, of load-cases, centrifugal"),
        ({"n_modes": 3, "interface_modes": 2, "interface_cutoff": 3.0}, "either interface_modes or interface_cutoff"),
        ({"n_modes": 3, "interfaces_together": True}, "belongs to interface_modes or interface_cutoff"),
        ({"set": "user-basis"}, "mode set 'user-basis' needs columns"),
        ({"set": "user-basis", "columns": "none.npy"}, "no such file"),
    ],
)
def test_options_that_do_not_fit_are_refused(keys, words):
    with pytest.raises(ValidationError) as caught:
        section(**keys)
    assert words in str(caught.value)


def test_the_measures_of_the_job_are_those_of_the_search():
    assert (*MEASURES, ESTIMATE) == MEASURE_NAMES

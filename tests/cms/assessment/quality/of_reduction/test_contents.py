"""Everything that a modal file holds has a verdict against its model, and a fault in any of it is named."""

import types
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import pytest

import cms
import fe_models as fm
from cms.assessment.quality.body_check import check_body
from cms.assessment.quality.of_reduction.contents import CONTENTS, Case, ReductionOptions, contents_records, record_of
from cms.assessment.quality.of_reduction.fields import FIELDS, Compared, apart, leaves
from cms.assessment.quality.of_reduction.full_shapes import full_shapes, same_body_record
from cms.assessment.quality.of_reduction.mass_properties import check_mass_properties
from cms.assessment.quality.reduction_check import check_reduction
from cms.assessment.quality.reference.full_reference import FullReference
from cms.body.reduced_body import ReducedBody
from cms.reduction.basis.damping import (
    ModalDamping,
    PerModeDamping,
    RampDamping,
    RayleighDamping,
    damping_of_words,
)
from cms.reduction.basis.free_basis import free_basis
from cms.reduction.recovery.request import RecoveryRequest, Rows
from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import Interface
from fe_models.body.kept_nodes import keep_nodes
from fe_models.body.load_cases import LoadCase
from fe_models.meshes.numbering import NamedSet, Numbering
from tests.bodies import STEEL, box_mesh, distorted
from tests.campaign.corruptions import CORRUPTIONS, spoilt
from tests.campaign.verdict import ACCEPTED
from tests.campaign.verdicts import JUDGED, verdict_case

SI = fm.unit_system("m-kg-s")


class Bench:
    """A sound body with its model, families and mode set."""

    def __init__(self, body, modes, options: ReductionOptions, **more: Any) -> None:
        self.body, self.modes, self.options = body, modes, options
        self.reduced = cms.reduce(body, modes, frame=options.frame, damping=options.damping, recovery=options.recovery,
                                  quadratic=options.quadratic, geometric=bool(options.geometric), errors=True,
                                  **more)  # fmt: skip
        self.reference = FullReference(body, band=2000.0)
        self.basis = free_basis(body, modes, self.reference.families)

    def record(self, name: str, reduced: ReducedBody) -> Any:
        """Return one record of a body against the model."""
        if name == "mass-properties":
            return check_mass_properties(self.body, reduced)
        shapes = full_shapes(self.body, self.basis, reduced)
        if name == "same-body":
            return same_body_record(self.body, self.basis, reduced, shapes)
        assert shapes is not None
        case = Case(self.body, self.modes, reduced, shapes.Phi, self.reference.families, self.basis, self.options)
        return record_of(name, case, CONTENTS[name])


@pytest.fixture(scope="module")
def solid():
    """Bricks in general position, a rigid and a distributing interface with axes of their own, all parts of a file."""
    rng = np.random.default_rng(3)
    mesh = distorted(box_mesh(4, 1, 1, 1.0, 0.3, 0.2), 0.1, seed=1)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    mesh = replace(mesh, nodes=mesh.nodes @ turn.T + [1.0, -2.0, 0.5])
    joints = [
        Interface(name, kind, mesh.node_sets[name], mesh.nodes[mesh.node_sets[name]].mean(axis=0), triad=axes)
        for name, kind, axes in (("left", "rigid", turn), ("right", "distributing", turn.T))
    ]
    body = fm.solid_body(mesh, STEEL, name="solid", units=SI, interfaces=joints)
    rows = np.arange(len(body.nodes))
    body = replace(body, numbering=Numbering(
        nodes=10 + 2 * rows, sets=(NamedSet("few", "nodes", rows[:5], 5), NamedSet("one", "nodes", rows[7:8], 1)),
    ))  # fmt: skip
    middle = np.flatnonzero(~np.isin(rows, np.concatenate([joint.nodes for joint in joints])))
    body = keep_nodes(body, [int(10 + 2 * k) for k in middle[:3]])
    f = np.zeros(body.n_dof)
    f[3 * middle[:2]] = [100.0, 50.0]
    body = couple(body.with_load_cases(LoadCase("push", "force", f)))
    modes = cms.craig_bampton(body, n_modes=4)
    rows_of = (
        Rows("acceleration", ("right",)), Rows("displacement", (int(10 + 2 * middle[0]),)),
        Rows("stress", (int(10 + 2 * middle[0]),)), Rows("element stress", (1,)), Rows("interface force"),
        Rows("net force", about=(0.0, 0.0, 0.0)),
    )  # fmt: skip
    return Bench(body, modes, ReductionOptions(
        ModalDamping(0.02), cms.NodalFrame("left"), True, True, True, (RecoveryRequest("all", rows_of),)
    ))  # fmt: skip


@pytest.fixture(scope="module")
def frame():
    """Beams with stress points: what the solid has not."""
    points = np.array([(3, 1, 2), (3.5, 1.1, 2), (4, 1, 2.1), (3.5, 1.1, 2.5), (4.2, 1.4, 2.4)])
    mesh = fm.beams.LineMesh(points, [(0, 1), (1, 2), (1, 3), (2, 4), (3, 4)])
    joints = [
        fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in (("left", 0), ("right", 2))
    ]
    made = fm.beam_body(
        mesh, fm.beams.BeamProperty(fm.beams.Rectangle(0.02, 0.04), STEEL), name="frame", units=SI, interfaces=joints
    )
    body = couple(fm.beams.section_points(made, [0, 3]))
    return Bench(body, cms.rubin(body, n_modes=3), ReductionOptions(RayleighDamping(2.0, 1e-6), None, True, True))


@pytest.fixture(scope="module")
def benches(solid, frame):
    return solid, frame


def paths_of(kind: Any, path: str = "") -> set[str]:
    """Return the paths of all fields of a type and of the records in it, by their annotations."""
    if get_origin(kind) is types.UnionType:
        return set().union(*(paths_of(part, path) for part in get_args(kind) if part is not type(None)))
    if is_dataclass(kind) and path not in ("units", "recovery.system"):
        hints = get_type_hints(kind)
        return set().union(*(paths_of(hints[f.name], f"{path}.{f.name}".removeprefix(".")) for f in fields(kind)))
    inner = [part for part in get_args(kind) if is_dataclass(part)]
    if get_origin(kind) in (tuple, Mapping) and inner:
        return paths_of(inner[0], path)
    return {path}


def test_every_field_of_a_reduced_body_has_a_verdict():
    assert paths_of(ReducedBody) == set(FIELDS)


def test_every_verdict_compares_the_fields_that_it_is_named_for(benches):
    """Of a sound body each passes, and the records tell which fields they have seen."""
    seen = {"units": "same-body"}  # other units are refused by name before
    for bench in benches:
        shapes = full_shapes(bench.body, bench.basis, bench.reduced)
        records = contents_records(
            bench.body, bench.modes, bench.reduced, shapes, bench.reference.families, bench.basis, bench.options
        )
        for record in records:
            assert record.verdict in ("pass", "info"), (record.name, record.reason)
            seen |= dict.fromkeys(record.data.get("fields", ()), record.name)
    of_others = {path: name for path, name in FIELDS.items() if name in ("same-body", "mass-properties")}
    assert seen | of_others == dict(FIELDS)


@pytest.mark.parametrize("what", CORRUPTIONS)
def test_a_corruption_is_found_by_the_record_that_it_is_named_for(benches, what):
    name, _ = CORRUPTIONS[what]
    rng, tried = np.random.default_rng(0), 0
    for bench in benches:
        bad = spoilt(what, bench.reduced, rng)
        if bad is not None:
            record = bench.record(name, bad)
            assert record.verdict in ("warn", "fail"), record.reason
            assert record.action
            tried += 1
    assert tried


def test_a_change_of_rounding_is_no_corruption(solid):
    """Shares of a source that no mode needs are zero to rounding; shuffled they are the same."""
    shares = np.ones(solid.reduced.energy_shares.shape)
    shares[:, 0] = 1e-29 * np.arange(1, 1 + len(shares))
    body = replace(solid.reduced, energy_shares=shares.copy())
    assert spoilt("energy shares shuffled", body, np.random.default_rng(0)) is None
    shares[:, 0] *= 1e20
    body = replace(solid.reduced, energy_shares=shares)
    assert spoilt("energy shares shuffled", body, np.random.default_rng(0)) is not None


def test_there_are_many_corruptions_and_each_record_has_one():
    assert len(CORRUPTIONS) >= 60
    assert {name for name, _ in CORRUPTIONS.values()} == set(FIELDS.values())


def test_the_named_fields_of_a_body_are_those_of_its_records(solid):
    found = leaves(solid.reduced)
    assert set(found) <= set(FIELDS)
    assert len(found["interfaces.name"]) == 2


def test_a_whole_check_tells_a_sound_body_from_a_spoilt_one(solid):
    def bad(reduced, options):
        records = check_reduction(solid.body, solid.modes, reduced, reference=solid.reference, options=options)
        return {record.name for record in records if record.verdict in ("warn", "fail") and record.name in JUDGED}

    assert bad(solid.reduced, solid.options) == set()
    assert bad(solid.reduced, None) == set()
    damped = replace(solid.reduced, D=10 * np.asarray(solid.reduced.D))
    assert "damping-matrix" in bad(damped, solid.options)
    assert "damping-matrix" in bad(damped, None)  # by the provenance
    assert bad(replace(solid.reduced, load_cases=(), errors=None), solid.options) == {"load-cases"}


def test_a_load_on_the_interface_that_carries_the_frame_has_no_modal_forces(solid):
    """They are rounding errors, which nothing is relative to: sound bodies failed by 100 % (seed 93118)."""
    own = solid.body.interface("left")
    f = np.zeros(solid.body.n_dof)
    f[own.dofs] = np.array([1.0, -2, 3, 0.1, 0.2, -0.3])
    body = replace(solid.body, load_cases=(LoadCase("pin", "force", f),))
    bench = Bench(body, solid.modes, ReductionOptions(frame=cms.NodalFrame("left"), stress=False))
    (load,) = bench.reduced.load_cases
    noise = 1e-13 * np.linalg.norm(f) * np.abs(bench.reduced.Phi).max() * np.array([1, -1] * len(load.h))[: len(load.h)]
    record = bench.record("load-cases", replace(bench.reduced, load_cases=(replace(load, h=load.h + noise),)))
    assert record.verdict == "pass", record.reason
    wrong = replace(bench.reduced, load_cases=(replace(load, h=load.h + 1e7 * noise),))
    assert bench.record("load-cases", wrong).verdict in ("warn", "fail")


def test_loads_to_which_the_modes_answer_exactly_leave_only_rounding_out(solid):
    """Constraint modes answer loads at the interfaces: what is left out is noise, which differs between computers."""
    modes = cms.modes.craig_bampton_ir(solid.body, n_modes=3)
    bench = Bench(solid.body, modes, ReductionOptions(frame=cms.TisserandFrame(), stress=False))
    reduced, left_out = bench.reduced, bench.reduced.errors.left_out
    forces = np.concatenate([each.Psi for each in reduced.interfaces])
    energy = (forces**2 / np.diag(reduced.K)).sum(axis=1).max()
    noise = np.sqrt(energy) * np.random.default_rng(1).choice([-1.0, 1.0], size=left_out.interfaces.shape)

    def verdict(size):
        other = replace(left_out, interfaces=left_out.interfaces + size * noise)
        return bench.record("error-estimates", replace(reduced, errors=replace(reduced.errors, left_out=other))).verdict

    assert verdict(1e-9) == "pass"
    assert verdict(1e-2) == "fail"


def test_largest_errors_of_frequencies_are_compared_by_decades(solid):
    """They are steps of a rule that rounding may change by one."""
    errors = solid.reduced.errors
    largest = np.where(np.isnan(errors.largest), 1.0, errors.largest)
    for factor, verdict in ((1.0, "pass"), (2.0, "pass"), (1e4, "fail")):
        other = replace(solid.reduced, errors=replace(errors, largest=largest * factor))
        assert solid.record("error-estimates", other).verdict == verdict


@pytest.mark.parametrize("what", [
    "3C of wrong sign", "4C and 5C beside the diagonal of wrong sign", "P transposed", "stress of the nodes shuffled",
    "stress of the modes shuffled", "stress yz and xy exchanged", "damping none", "labels of the modes shuffled",
    "energy shares shuffled", "turned loads of spin", "quadratic modes of wrong sign",
    "geometric stiffness of interfaces shuffled", "recovery: stress twice", "recovery: acceleration of wrong sign",
    "recovery: interface force of wrong sign", "rows of another order", "mass 10 % more",
])  # fmt: skip
def test_the_file_alone_tells_what_contradicts_itself(solid, what):
    known = CORRUPTIONS.get(what) or CORRUPTIONS["recovery: rows shuffled"]
    bad = known[1](solid.reduced, np.random.default_rng(0))
    records = {record.name: record for record in check_body(bad)}
    assert any(records[name].verdict in ("warn", "fail") for name in JUDGED if name in records)


def test_the_file_alone_is_sound_and_says_what_it_cannot_know(benches):
    for bench in benches:
        records = {record.name: record for record in check_body(bench.reduced)}
        assert not [name for name in JUDGED if name in records and records[name].verdict in ("warn", "fail")]
        assert records["scope"].reason.startswith("not checked without the model: ")
    assert "load cases" in {record.name: record for record in check_body(benches[0].reduced)}["scope"].reason
    assert "load cases" not in records["scope"].reason


@pytest.mark.parametrize("damping", [
    None, ModalDamping(0.02), PerModeDamping((0.01, 0.03)), RampDamping(), RayleighDamping(0.5, 1e-5),
])  # fmt: skip
def test_damping_is_read_back_from_the_words_of_the_provenance(damping):
    assert damping_of_words(str(damping) if damping else "none") == damping


@pytest.mark.parametrize("words", ["", "none", "os.remove('x')", "ModalDamping(", "ModalDamping(0.02)", "Other(a=1)"])
def test_other_words_are_no_damping(words):
    assert damping_of_words(words) is None


@pytest.mark.parametrize("seed", range(300, 304))
def test_a_random_sound_body_raises_no_alarm_and_a_spoilt_one_does(seed, tmp_path):
    verdict = verdict_case(seed, tmp_path)
    assert verdict.kind == ACCEPTED, verdict.words


@pytest.mark.parametrize("size", [0.0, 1.0, np.nan])
def test_a_number_that_is_none_is_never_equal(size):
    found = apart("D", np.array([1.0, np.nan]), np.array([1.0, 2.0]), size)
    assert not found.defect <= 1e300
    record = record_of("damping-matrix", None, lambda _: iter([Compared("K", 1e-16), found, Compared("D", 0.0)]))
    assert record.verdict == "fail"
    assert not record.data["fields"]["D"] <= 1e300

"""The geometric stiffness of a converted body is that of the body reduced in that frame."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import cms
import fe_models as fm
from cms.body.geometric_stiffness import UNIT_LOADS, GeometricStiffness, RotatedLoads, SpreadLoads
from cms.errors import BodyError, ModalFileError
from cms.reduction.basis.frames import BuckensFrame, NodalFrame, TisserandFrame
from fe_models.body.loads import gravity_load
from fe_models.body.weld import weld
from fe_models.elements.beams.attachments import PointMass, RigidLink
from fe_models.elements.beams.beam_property import BeamProperty
from fe_models.elements.beams.body import beam_body
from fe_models.elements.beams.sections import Rectangle
from fe_models.elements.interfaces import NodeIndices, line_interface
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.numbering import Numbering
from tests.bodies import STEEL, bar, with_interfaces
from tests.cms.command import run_cms
from tests.cms.examples import FRAMES, uneven_bar
from tests.cms.reduction.geometric_stiffness.examples import SI, bar_of_beams
from tests.synthetic import synthetic_reduced_body

SLACK = 1e-8  #: rounding of the static states times the condition of the change of frame


def frame_of_beams():
    """A crooked beam with eccentric ends, a mass off its node and a rigid link."""
    points = np.array([[0, 0, 0], [0.2, 0.02, 0], [0.4, 0, 0.05], [0.6, -0.03, 0.1], [0.7, 0.1, 0.1], [0.5, 0.1, 0.1]])
    mesh = LineMesh(points, np.array([[0, 1], [1, 2], [2, 3], [3, 4]]))
    ends = [
        line_interface(mesh, name, NodeIndices((node,)), reference=at)
        for name, node, at in (("left", 0, (0.0, 0.02, -0.03)), ("right", 4, None))
    ]
    section = BeamProperty(Rectangle(0.02, 0.03), STEEL, offset=(0.01, -0.02))
    body = beam_body(
        mesh, section, name="bar", units=SI, interfaces=ends, links=[RigidLink(3, (5,))],
        point_masses=[PointMass(1, 0.3, 1e-4, (0, 0.05, 0.02)), PointMass(5, 0.2)],
    )  # fmt: skip
    return cms.couple(body.with_load_cases(gravity_load(body, "weight", (1.0, 2.0, -9.81))))


def warped_shell():
    """A warped strip with an offset, a mass that grows along it, and an interface of each kind."""

    def surface(u, v):
        return np.stack([np.sin(1.2 * u), 0.3 * v + 0.1 * u * v, np.cos(1.2 * u) + 0.1 * v**2], axis=1)

    mesh = fm.shells.mapped_shell(surface, 4, 2, kind="quad")
    ends = [
        fm.shells.shell_interface(mesh, "left", fm.selections.NodeSet("u0"), reference=(0.0, 0.1, 1.05)),
        fm.shells.shell_interface(mesh, "right", fm.selections.NodeSet("u1"), kind="distributing"),
    ]
    body = fm.shell_body(mesh, fm.shells.ShellProperty(0.02, STEEL, offset=0.01), name="bar", units=SI, interfaces=ends)
    return cms.couple(
        body.with_load_cases(fm.loads.pressure_load(body, mesh, "push", fm.selections.FaceGroup("shell"), 3.0))
    )


def welded_bar():
    """A solid and a beam in one piece, whose joint is off both."""
    solid, beam = bar(3, 1, 1, width=0.06), bar_of_beams(3)
    left, joint = solid.interfaces
    solid = with_interfaces(
        solid, replace(left, name="left"), replace(joint, name="joint", reference=[1.02, 0.01, 0.0])
    )
    joint, right = beam.interfaces
    beam = with_interfaces(beam, replace(joint, name="joint"), replace(right, name="right"))
    parts = [replace(cms.couple(body), name=name) for name, body in (("solid", solid), ("beam", beam))]
    return weld(parts, [(("solid", "joint"), ("beam", "joint"))], name="bar")


BODIES = {"beams": frame_of_beams, "shell": warped_shell, "welded": welded_bar}


def reductions(body, names):
    """Return a coupled body reduced in some frames, from one mode set."""
    with cms.modes.Families(body) as families:
        modes = cms.craig_bampton(families, n_modes=5)
        return {name: cms.reduce(families, modes, frame=FRAMES[name], geometric=True) for name in names}


@pytest.fixture(scope="module")
def made():
    return reductions(cms.couple(uneven_bar()), FRAMES)


def arrays_of(reduced, sign=1.0):
    """Every array of the geometric stiffness, for modes of these signs."""
    geometric, spread, both = reduced.geometric, reduced.geometric.spread, np.multiply.outer(sign, sign)
    found = {name: getattr(geometric, name) * both for name in UNIT_LOADS}
    found |= {f"{name} turned": getattr(geometric.turned, name) * sign for name in UNIT_LOADS}
    found |= {"spread": spread.K * both, "spread turned": spread.turned * sign}
    return found | {"spread, turned, rigid": spread.turned_rigid}


def assert_same(found, expected):
    """Every number of the geometric stiffness and the load cases is the expected one, but for the signs of modes."""
    sign = np.sign(np.einsum("nck,nck->k", expected.Phi, found.Phi))
    values, expected_values = arrays_of(found, sign), arrays_of(expected)
    for name, value in expected_values.items():
        scale = max(np.abs(value).max(), np.abs(values[name]).max())
        assert_allclose(values[name], value, rtol=0, atol=SLACK * scale, err_msg=name)
    for a, b in zip(found.load_cases, expected.load_cases, strict=True):
        assert_allclose(a.h * sign, b.h, rtol=0, atol=SLACK * np.linalg.norm(b.force) * np.abs(expected.Phi).max())


@pytest.mark.parametrize("target", [name for name in FRAMES if name != "nodal"])
@pytest.mark.parametrize("source", FRAMES)
def test_converted_matrices_are_those_of_the_body_reduced_in_that_frame(made, source, target):
    assert_same(cms.reduction.convert_frame(made[source], FRAMES[target]), made[target])


@pytest.mark.parametrize("kind", BODIES)
def test_a_buckens_frame_and_back_for_every_kind_of_element(kind):
    frames = ("tisserand", "buckens turned", "nodal left", "nodal right turned")
    made = reductions(BODIES[kind](), frames)
    buckens = made["buckens turned"]
    for name in frames:
        assert_same(cms.reduction.convert_frame(made[name], FRAMES["buckens turned"]), buckens)
        assert_same(cms.reduction.convert_frame(buckens, FRAMES[name]), made[name])


def test_a_buckens_frame_needs_no_matrices_of_its_reaction(made):
    """Converted to it they are zero, not rounding; in other frames they are there."""
    assert not made["buckens"].geometric.spread.K.any()
    assert not cms.reduction.convert_frame(made["nodal left"], BuckensFrame()).geometric.spread.K.any()
    assert made["tisserand"].geometric.spread.K.any()


def as_before_version_4(reduced):
    return replace(reduced, geometric=replace(reduced.geometric, turned=None, spread=None))


def test_a_reaction_that_is_not_on_record_is_refused(made):
    """One frame is held at dofs of several nodes; the other needs the spread loads."""
    with pytest.raises(BodyError, match=r"'bar': its geometric stiffness can .* whose reaction is no load at one"):
        cms.reduction.convert_frame(made["tisserand"], NodalFrame())
    with pytest.raises(BodyError, match=r"distributed over the nodes, is not stored .*reduce the body anew"):
        cms.reduction.convert_frame(as_before_version_4(made["tisserand"]), BuckensFrame())
    for target in (NodalFrame(), BuckensFrame()):
        assert cms.reduction.convert_frame(replace(made["tisserand"], geometric=None), target).geometric is None
    assert (
        cms.reduction.convert_frame(as_before_version_4(made["tisserand"]), NodalFrame("left")).geometric.spread is None
    )


def test_a_file_of_an_older_version_goes_where_it_went(made, caplog):
    """Without a record of how its loads turn a rotation is taken to turn them, which in solids and beams it does."""
    beams = reductions(frame_of_beams(), ("nodal left", "tisserand"))
    for bodies, source, target in ((made, "nodal right", "tisserand"), (made, "buckens", "nodal left"),
                                   (beams, "nodal left", "tisserand")):  # fmt: skip
        found, expected = (
            cms.reduction.convert_frame(as_before_version_4(bodies[source]), FRAMES[target]),
            bodies[target],
        )
        sign = np.sign(np.einsum("nck,nck->k", expected.Phi, found.Phi))
        for name in UNIT_LOADS:
            K, K_expected = getattr(found.geometric, name), getattr(expected.geometric, name) * np.outer(sign, sign)
            assert_allclose(K, K_expected, rtol=0, atol=10 * SLACK * np.abs(K_expected).max(), err_msg=name)
    assert not caplog.text


def test_coarse_shells_need_the_record(caplog):
    """Turned loads stand for it only as their cells get small: the fourth part of the largest entry is missed here."""
    made = reductions(warped_shell(), ("nodal left", "tisserand"))
    cms.reduction.convert_frame(made["nodal left"], TisserandFrame())
    assert not caplog.text
    found = cms.reduction.convert_frame(as_before_version_4(made["nodal left"]), TisserandFrame()).geometric.spin
    assert "from before version 4 and it has shells" in caplog.text
    expected = cms.reduction.convert_frame(made["nodal left"], TisserandFrame()).geometric.spin
    assert np.abs(found - expected).max() > 0.25 * np.abs(expected).max()


def test_the_command_carries_it_and_leaves_it_out_where_asked(tmp_path, made):

    cms.write(made["tisserand"], tmp_path / "bar.h5")
    command = ["frame", str(tmp_path / "bar.h5"), "--to", "buckens"]
    run_cms(*command, code=0)
    assert_same(cms.read(tmp_path / "bar_buckens.h5"), made["buckens"])
    (tmp_path / "bar_buckens.h5").unlink()
    run_cms(*command, "--no-geometric-stiffness", code=0)
    assert cms.read(tmp_path / "bar_buckens.h5").geometric is None


def test_a_file_of_an_older_version_keeps_its_matrices_and_refuses(tmp_path, made):
    """As a program wrote it that knew no loads spread over the nodes; the command leaves nothing behind."""

    unnumbered = replace(made["tisserand"], numbering=Numbering())
    cms.write(as_before_version_4(unnumbered), tmp_path / "bar.h5")
    assert (tmp_path / "bar.h5").read_bytes().startswith(b"floatframe modal-file 2\n")
    assert cms.read(tmp_path / "bar.h5").geometric.spread is None
    refused = run_cms("frame", tmp_path / "bar.h5", "--to", "buckens")
    assert refused.exit_code != 0
    assert not (tmp_path / "bar_buckens.h5").exists()
    cms.write(unnumbered, tmp_path / "bar.h5")
    assert (tmp_path / "bar.h5").read_bytes().startswith(b"floatframe modal-file 4\n")
    cms.write(made["tisserand"], tmp_path / "bar.h5")  # with the sets of its mesh
    assert (tmp_path / "bar.h5").read_bytes().startswith(b"floatframe modal-file 5\n")


def test_the_file_keeps_every_number(tmp_path, made):
    cms.write(made["nodal left"], tmp_path / "bar.h5")
    found = cms.read(tmp_path / "bar.h5")
    expected = arrays_of(made["nodal left"])
    for name, value in arrays_of(found).items():
        assert_array_equal(value, expected[name], err_msg=name)
    assert cms.read(tmp_path / "bar.h5", units="mm-t-s").geometric is not None


def test_other_units_are_those_of_the_class():
    """The dimensions of the file against those of `GeometricStiffness.in_units`."""
    rng = np.random.default_rng(0)
    body = synthetic_reduced_body(n_q=3)
    arrays = [rng.standard_normal((*n, 3, 3)) for n in ((3,), (3,), (6,), (len(body.interfaces), 6))]
    arrays = [K + np.swapaxes(K, -1, -2) for K in arrays]
    turned = RotatedLoads(
        *(rng.standard_normal(n) for n in ((3, 3, 3), (3, 3, 3), (6, 3, 3), (len(body.interfaces), 6, 3, 3)))
    )
    K = rng.standard_normal((6, 3, 3))
    spread = SpreadLoads(K + np.swapaxes(K, 1, 2), rng.standard_normal((6, 3, 3)), rng.standard_normal((6, 3, 3)))
    body = replace(body, geometric=GeometricStiffness(*arrays, turned, spread))
    new = cms.body.convert_units(body, "in-slinch-s")
    expected = arrays_of(replace(new, geometric=body.geometric.in_units(body.units, new.units)))
    for name, value in arrays_of(new).items():
        assert_allclose(value, expected[name], rtol=1e-12, err_msg=name)


def test_a_file_without_the_group_has_none(tmp_path):
    cms.write(synthetic_reduced_body(n_q=3), tmp_path / "body.h5")
    assert cms.read(tmp_path / "body.h5").geometric is None


def test_a_matrix_of_another_size_is_named(made):
    from cms.body.modal_file.content import body_of, content_of
    from cms.body.modal_file.file import VERSION

    content = content_of(made["tisserand"], VERSION)
    datasets = dict(content.datasets)
    path = "/interfaces/1/K_geometric"
    datasets[path] = replace(datasets[path], values=np.zeros((6, 2, 2)))
    with pytest.raises((BodyError, ModalFileError), match=path):
        body_of(replace(content, datasets=datasets))
    for path in ("spread/K", "spread/turned", "spread/turned_rigid", "turned/spin"):
        path = f"/geometric/{path}"
        short = replace(content.datasets[path], values=np.zeros((6, 2, 2)))
        with pytest.raises(BodyError, match=rf"{path.split('/')[-1]}: expected shape \(6, "):
            body_of(replace(content, datasets={**content.datasets, path: short}))
    for path in ("/geometric/spread/turned", "/geometric/turned/spin", "/interfaces/1/K_turned"):
        rest = {other: dataset for other, dataset in content.datasets.items() if other != path}
        with pytest.raises(ModalFileError, match=f"dataset {path} is missing"):
            body_of(replace(content, datasets=rest))


def test_spread_loads_stand_with_what_they_need(made):
    with pytest.raises(BodyError, match="spread over the nodes need the nodal sums"):
        replace(made["tisserand"], nodal_sums=None)
    with pytest.raises(BodyError, match="expected turned loads too"):
        replace(made["tisserand"].geometric, turned=None)

"""The geometric stiffness of a converted body is that of the body reduced in that frame."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import cms
from cms.errors import BodyError, ModalFileError
from cms.reduced_basis.frames import BuckensFrame, NodalFrame, TisserandFrame
from cms.reduced_body.geometric_stiffness import GeometricStiffness
from tests.cms.test_frame_conversion import TURNED, uneven_bar
from tests.synthetic import synthetic_reduced_body

FRAMES = {
    "tisserand": TisserandFrame(),
    "tisserand turned": TisserandFrame(origin=(0.2, -0.1, 0.3), axes=TURNED),
    "buckens": BuckensFrame(),
    "nodal left": NodalFrame("left"),
    "nodal right": NodalFrame("right"),
    "nodal right turned": NodalFrame("right", axes=TURNED),
    "nodal": NodalFrame(),
}
MATRICES = ("translation", "rotation", "spin", "interfaces")
SLACK = 1e-7  #: rounding of the static states times the condition of the change of frame


@pytest.fixture(scope="module")
def made():
    body = cms.couple(uneven_bar())
    with cms.Families(body) as families:
        modes = cms.craig_bampton(families, n_modes=5)
        return {name: cms.reduce(families, modes, frame=frame, geometric=True) for name, frame in FRAMES.items()}


@pytest.mark.parametrize("target", ["tisserand", "tisserand turned", "nodal left", "nodal right", "nodal right turned"])
@pytest.mark.parametrize("source", ["tisserand", "nodal left", "buckens", "nodal right turned", "nodal"])
def test_converted_matrices_are_those_of_the_body_reduced_in_that_frame(made, source, target):
    expected = made[target]
    found = cms.convert_frame(made[source], FRAMES[target])
    sign = np.sign(np.einsum("nck,nck->k", expected.Phi, found.Phi))
    for name in MATRICES:
        K, K_expected = getattr(found.geometric, name) * np.outer(sign, sign), getattr(expected.geometric, name)
        assert_allclose(
            K, K_expected, rtol=0, atol=SLACK * max(np.abs(K_expected).max(), np.abs(K).max()), err_msg=name
        )


@pytest.mark.parametrize("target", [BuckensFrame(), NodalFrame()], ids=["buckens", "nodal"])
def test_a_reaction_that_is_no_unit_load_is_refused(made, target):
    with pytest.raises(BodyError, match="'bar': its geometric stiffness can go to a Tisserand frame"):
        cms.convert_frame(made["tisserand"], target)
    without = cms.convert_frame(replace(made["tisserand"], geometric=None), target)
    assert without.geometric is None


def test_the_command_leaves_the_geometric_stiffness_out_where_asked(tmp_path, made):
    from typer.testing import CliRunner

    from cms.cli.app import app

    cms.write(made["tisserand"], tmp_path / "bar.h5")
    command = ["frame", str(tmp_path / "bar.h5"), "--to", "buckens"]
    refused = CliRunner().invoke(app, command)
    assert refused.exit_code != 0
    assert not (tmp_path / "bar_buckens.h5").exists()
    result = CliRunner().invoke(app, [*command, "--no-geometric-stiffness"])
    assert result.exit_code == 0, result.output
    assert cms.read(tmp_path / "bar_buckens.h5").geometric is None


def test_the_file_keeps_every_number(tmp_path, made):
    cms.write(made["nodal left"], tmp_path / "bar.h5")
    found = cms.read(tmp_path / "bar.h5")
    for name in MATRICES:
        assert_array_equal(getattr(found.geometric, name), getattr(made["nodal left"].geometric, name))
    assert cms.read(tmp_path / "bar.h5", units="mm-t-s").geometric is not None


def test_other_units_are_those_of_the_class():
    """The dimensions of the file against those of `GeometricStiffness.in_units`."""
    rng = np.random.default_rng(0)
    body = synthetic_reduced_body(n_q=3)
    arrays = [rng.standard_normal((*n, 3, 3)) for n in ((3,), (3,), (6,), (len(body.interfaces), 6))]
    arrays = [K + np.swapaxes(K, -1, -2) for K in arrays]
    body = replace(body, geometric=GeometricStiffness(*arrays))
    new = cms.convert_units(body, "in-slinch-s")
    expected = body.geometric.in_units(body.units, new.units)
    for name in MATRICES:
        assert_allclose(getattr(new.geometric, name), getattr(expected, name), rtol=1e-12)


def test_a_file_without_the_group_has_none(tmp_path):
    cms.write(synthetic_reduced_body(n_q=3), tmp_path / "body.h5")
    assert cms.read(tmp_path / "body.h5").geometric is None


def test_a_matrix_of_another_size_is_named(made):
    from cms.modal_file.content import body_of, content_of
    from cms.modal_file.file import VERSION

    content = content_of(made["tisserand"], VERSION)
    datasets = dict(content.datasets)
    path = "/interfaces/1/K_geometric"
    datasets[path] = replace(datasets[path], values=np.zeros((6, 2, 2)))
    with pytest.raises((BodyError, ModalFileError), match=path):
        body_of(replace(content, datasets=datasets))

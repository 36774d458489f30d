"""The table of writers, the command, and every refusal: one message, nothing written."""

from dataclasses import replace

import numpy as np
import pytest

import cms
from cms.body.modal_file.file import convert_units
from cms.errors import ExportError, ModalFileError, UnitsError
from cms.exchange.export import WRITERS, export_body
from fe_models.foundation.units import unit_system
from tests.cms.command import run_cms
from tests.cms.exchange.exporters.small_bodies import cloud_body
from tests.synthetic import synthetic_reduced_body


@pytest.fixture(scope="module")
def body():
    return cloud_body()[0]


@pytest.fixture(scope="module")
def modal_file(tmp_path_factory, body):
    path = tmp_path_factory.mktemp("modal") / "body.h5"
    cms.write(body, path)
    return path


def run(*arguments):
    return run_cms("export", *arguments)


FLOATING = ("mbsim", "exudyn", "mbdyn", "sid_fem", "sid_fem-fembeam")


@pytest.mark.parametrize("to", [*FLOATING, "vtk"])
def test_the_command_writes_and_says_what_is_left_out(to, modal_file, tmp_path):
    suffix = WRITERS[to].suffixes[0]
    result = run(modal_file, "--to", to, "--units", "m-kg-s", "-o", tmp_path / f"out{suffix}")
    assert result.exit_code == 0, result.output
    assert f"wrote {tmp_path / 'out'}" in result.output
    assert "units: m-kg-s (m, kg, s)" in result.output
    assert "not held by this format:" in result.output
    assert "load cases" in result.output


@pytest.mark.parametrize("to", WRITERS)
def test_two_exports_are_equal_byte_for_byte(to, tmp_path):
    """No time and no chance in the files; physical formats of a body that has an interface model."""
    from tests.cms.exchange.exporters.examples import reduced_bar

    body = reduced_bar("left") if to not in FLOATING else cloud_body()[0]
    files = [cms.exchange.export_body(body, tmp_path / str(k) / "b.x", to=to, units="m-kg-s") for k in range(2) if not
             (tmp_path / str(k)).mkdir()]  # fmt: skip
    for first, second in zip(*(exported.files for exported in files), strict=True):
        assert first.name == second.name
        assert first.read_bytes() == second.read_bytes()


def test_a_name_without_suffix_gets_that_of_the_format(body, tmp_path):
    assert cms.exchange.export_body(body, tmp_path / "a", to="mbdyn", units="m-kg-s").files == (tmp_path / "a.fem",)
    assert cms.exchange.export_body(body, tmp_path / "a.x", to="mbdyn", units="m-kg-s").files == (tmp_path / "a.x",)


def test_the_header_is_ascii(body, tmp_path):
    told = replace(body, provenance={"solver": "L Lᵀ, 2·10⁻⁶ ≤ größe", "mesh": "rod.msh"})
    cms.exchange.export_body(told, tmp_path / "a.fem", to="mbdyn", units="m-kg-s")
    assert "** solver: L L^T, 2*10-6 <= grosse" in (tmp_path / "a.fem").read_text(encoding="ascii")


def test_numbers_are_those_of_the_units_asked_for(body, tmp_path):
    import h5py

    for units in ("m-kg-s", "mm-t-s"):
        cms.exchange.export_body(body, tmp_path / f"{units}.h5", to="mbsim", units=units)
    si, mm = (h5py.File(tmp_path / f"{units}.h5") for units in ("m-kg-s", "mm-t-s"))
    with si, mm:
        assert si["mass"][()] == pytest.approx(1000 * mm["mass"][()], rel=1e-14)
        np.testing.assert_allclose(si["position integral"], np.asarray(mm["position integral"]) * 1.0, rtol=1e-14)
        np.testing.assert_allclose(
            si["position position integral"], 1e-3 * np.asarray(mm["position position integral"])
        )


def test_the_header_names_the_modal_file_and_its_digest(modal_file, tmp_path):
    from cms.body.modal_file.file import digest

    cms.exchange.export_body(modal_file, tmp_path / "b.fem", to="mbdyn", units="m-kg-s")
    text = (tmp_path / "b.fem").read_text(encoding="ascii")
    assert digest(modal_file) in text
    assert "** units m-kg-s: m, kg, s" in text
    assert "** mesh: rod.msh" in text


def refused(tmp_path, match, body, to="mbsim", error=ExportError, **options):
    options = {"units": "m-kg-s", **options}
    with pytest.raises(error, match=match):
        export_body(body, tmp_path / "out.h5", to=to, **options)
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_format_is_refused_with_the_nearest(body, tmp_path):
    refused(tmp_path, "unknown format 'mbsin'; did you mean 'mbsim'", body, to="mbsin")
    refused(tmp_path, "'mnf': the file format of Adams is not documented.* nastran-dmig", body, to="mnf")
    refused(tmp_path, "'Simpack': the file format of Simpack is not documented.* sid_fem", body, to="Simpack")


def test_units_are_those_of_the_file_where_none_are_said(body, tmp_path):
    assert export_body(body, tmp_path / "own.h5", to="mbsim").units == body.units
    (tmp_path / "own.h5").unlink()
    other = convert_units(body, unit_system("mm-t-s"))
    assert export_body(other, tmp_path / "own.h5", to="mbsim").units.name == "mm-t-s"
    (tmp_path / "own.h5").unlink()
    refused(tmp_path, "unknown unit system 'm-kg'", body, error=UnitsError, units="m-kg")
    refused(
        tmp_path, "units mm-t-s: the program behind ext_ptfm accepts only m-kg-s", body, to="ext_ptfm", units="mm-t-s"
    )


def test_nodes_are_interfaces_or_all(body, tmp_path):
    refused(tmp_path, "nodes = 'some': expected 'interfaces' or 'all'", body, nodes="some")


@pytest.mark.parametrize("to", [key for key, writer in WRITERS.items() if not writer.takes_held])
def test_a_held_body_has_no_floating_frame(to, body, tmp_path):
    held = replace(body, frame=replace(body.frame, kind="held", at="", dofs=np.zeros((0, 2), int)))
    refused(tmp_path, "is held to the ground", held, to=to)


@pytest.mark.parametrize("to", FLOATING)
def test_missing_inertia_terms_are_named(to, body, tmp_path):
    foreign = replace(body, moments=replace(body.moments, missing=("3C", "5C")))
    refused(tmp_path, "3C, 5C of this body are missing", foreign, to=to)


def test_a_body_without_what_the_format_is_made_of(tmp_path):
    rigid = synthetic_reduced_body(n_q=0)
    refused(tmp_path, "has no modes, so it is rigid", rigid)
    body = synthetic_reduced_body()
    bare = replace(body, interfaces=(), geometric=None)
    refused(tmp_path, "has no interfaces", bare, to="mbdyn")
    empty = replace(
        body, nodes=np.zeros((0, 3)), node_ids=[], Phi=np.zeros((0, 3, 5)), surface=np.zeros((0, 3), int), stress=None,
        interfaces=[replace(each, members=[]) for each in body.interfaces],
    )  # fmt: skip
    refused(tmp_path, "has no nodes with shapes", empty, to="exudyn")


def test_no_modal_file_no_export(tmp_path):
    (tmp_path / "sub").mkdir()
    with pytest.raises(ModalFileError):
        export_body(tmp_path / "none.h5", tmp_path / "sub" / "out.h5", to="mbsim", units="m-kg-s")
    assert list((tmp_path / "sub").iterdir()) == []


def test_the_command_refuses_before_any_work(modal_file, tmp_path):
    for arguments, words in (
        (("--to", "nastran"), "unknown format"),
        (("--to", "mbdyn", "--units", "m-kg-s", "-o", tmp_path / "no" / "out.fem"), "does not exist; make it first"),
        (("--to", "mbdyn", "--units", "m-kg-s", "-o", modal_file), "this is an input"),
        (("--to", "ext_ptfm", "--units", "m-kg-s", "--load", "weight"), "expected NAME=AMPLITUDE"),
    ):
        result = run(modal_file, *arguments)
        assert result.exit_code == 2, result.output
        assert result.stderr.startswith("error: ")
        assert words in result.stderr
    assert list(tmp_path.iterdir()) == []
    assert [path.name for path in modal_file.parent.iterdir()] == ["body.h5"]


def test_a_place_that_cannot_be_written(body, tmp_path):
    """The folder is a file: refused for root too."""
    (tmp_path / "shut").write_text("")
    with pytest.raises(ExportError, match=r"cannot be written: .*; nothing was written"):
        export_body(body, tmp_path / "shut" / "out.h5", to="mbsim", units="m-kg-s")


def test_a_device_takes_a_single_file_only(body, tmp_path):
    cms.exchange.export_body(body, "/dev/null", to="mbdyn", units="m-kg-s")
    with pytest.raises(ExportError, match=r"is a device or a pipe, but exudyn consists of several files"):
        cms.exchange.export_body(body, "/dev/null", to="exudyn", units="m-kg-s")


def test_files_that_belong_together_appear_together_or_not_at_all(body, tmp_path, monkeypatch):
    """The second of two files fails while it is written: neither is there, and the old one is unchanged."""
    from fe_models.foundation import paths

    (tmp_path / "b.npz").write_bytes(b"old")
    written = []

    def write_part(part, *parts):
        written.append(part)
        if len(written) == 2:
            raise OSError(28, "No space left on device")
        part.write_bytes(b"".join(parts))

    monkeypatch.setattr(paths, "write_part", write_part)
    with pytest.raises(ExportError, match=r"No space left on device; nothing was written"):
        export_body(body, tmp_path / "b.npz", to="exudyn", units="m-kg-s")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("b.npz", b"old")]


@pytest.mark.parametrize("to", ["mbsim", "mbdyn", "sid_fem", "exudyn", "nastran-op4", "nastran-dmig", "mat"])
def test_turned_axes_of_interfaces_are_said_to_be_lost(to, tmp_path):
    """Files over B lose what is turned against B, files over the mesh what is turned against the mesh."""
    from tests.cms.exchange.exporters.examples import reduced_bar

    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    body = reduced_bar("left", "right")
    over_mesh = to in ("nastran-op4", "nastran-dmig", "mat")
    straight = body.frame.axes.T if over_mesh else np.eye(3)

    def lost(triad):
        each = replace(body, interfaces=[replace(x, triad=triad) for x in body.interfaces])
        told = cms.exchange.export_body(each, tmp_path / "b", to=to, units="m-kg-s").left_out
        return [words for words in told if words.startswith("axes of the interfaces")]

    assert lost(straight) == []
    assert len(lost(straight @ turn)) == (to != "exudyn")

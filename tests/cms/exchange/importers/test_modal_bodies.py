"""Bodies of other multibody programs: what our writers wrote comes back as the same body, and damage is told."""

import re
import shutil
from dataclasses import replace

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from cms.errors import BodyError, ForeignBodyError
from cms.exchange.export import export_body
from cms.exchange.importers.modal_body import ForeignInterface, ModalBody, body_of_modes, changed, momentum_of
from cms.exchange.importers.superelement_body import ImportOptions
from fe_models.body.loads import nodal_load
from tests.bodies import bar
from tests.cms.exchange.exporters.small_bodies import soft_bar

FORMATS = {"mbsim": ".h5", "exudyn": ".npz", "mbdyn": ".fem", "sid_fem": ".SID_FEM", "sid_fem-fembeam": ".SID_FEM"}


@pytest.fixture(scope="module")
def mean():
    """A body in mean axes, whose modes other programs can hold as they are."""
    part = cms.couple(bar(nx=4, width=0.07, height=0.04))
    body = cms.reduce(
        part, cms.craig_bampton(part, n_modes=2), geometric=False, damping=cms.reduction.ModalDamping(0.01)
    )
    return cms.body.convert_units(body, "mm-t-s")


def written(body, key, folder):
    path = folder / f"part{FORMATS[key]}"
    export_body(body, path, to=key, units=body.units)
    return path


def names_of(body, key):
    """Nodes of the interfaces, where the format has no names: SID and MBDyn hold the interfaces alone, 1, 2, ...."""
    return {i.name: [k + 1] for k, i in enumerate(body.interfaces)} if key not in ("mbsim", "exudyn") else None


@pytest.mark.parametrize("key", FORMATS)
def test_a_body_in_mean_axes_comes_back_as_it_was(mean, key, tmp_path):
    path = written(mean, key, tmp_path)
    body = cms.exchange.import_body(path, units="mm-t-s", interfaces=names_of(mean, key))
    assert body.frame.kind == "tisserand"
    assert body.moments.missing == ()
    assert_allclose(np.diag(body.K), np.diag(mean.K), rtol=1e-10)
    assert_allclose(body.free_frequencies, mean.free_frequencies, rtol=1e-9)
    assert_allclose(body.moments.m, mean.moments.m, rtol=1e-12)
    left, own = body.interface("left"), mean.interface("left")
    flip = np.sign(np.einsum("ak,ak->k", left.Psi[:3], own.Psi[:3]) + 1e-300)
    assert_allclose(left.Psi * flip, own.Psi, rtol=0, atol=1e-8 * np.abs(own.Psi).max())
    assert_allclose(left.position, own.position, rtol=0, atol=1e-9)
    signs = flip[:, None] * flip
    for name in ("S", "J0"):
        expected, size = getattr(mean.moments, name), np.abs(mean.moments.J0).max()
        assert_allclose(getattr(body.moments, name), expected, rtol=0, atol=1e-9 * size)
    assert_allclose(body.moments.P * flip, mean.moments.P, rtol=0, atol=1e-7 * np.abs(mean.moments.P).max())
    assert_allclose(body.moments.S_kl * signs, mean.moments.S_kl, rtol=0, atol=1e-7)
    assert_allclose(np.diag(body.D), np.diag(mean.D), rtol=1e-8)
    verdicts = {record.name: record.verdict for record in cms.check_body(body)}
    assert "fail" not in verdicts.values(), verdicts
    assert verdicts["inertia-terms"] == "pass"


def test_a_file_in_other_units_is_told(mean, tmp_path):
    """A bar of 1 m and some 20 kg as one of 1 km and 20 g."""
    for key in FORMATS:
        path = written(mean, key, tmp_path)
        with pytest.raises(ForeignBodyError, match=r"units m-kg-s: .*; name the units of the file"):
            cms.exchange.import_body(path, units="m-kg-s", interfaces=names_of(mean, key))
        assert (
            cms.exchange.import_body(path, units="m-kg-s", interfaces=names_of(mean, key), accept=["units"]).n_q
            == mean.n_q
        )


@pytest.mark.parametrize("key", FORMATS)
def test_a_body_in_another_frame_is_moved_to_mean_axes(key, tmp_path):
    soft = soft_bar(6)
    body = cms.exchange.import_body(
        written(soft, key, tmp_path), units=soft.units, interfaces=names_of(soft, key), accept=["units"]
    )
    expected = cms.reduction.convert_frame(soft, cms.TisserandFrame())
    assert body.frame.kind == "tisserand"
    assert_allclose(np.diag(body.K), np.diag(expected.K), rtol=1e-8)
    assert_allclose(body.moments.J0, expected.moments.J0, rtol=0, atol=1e-9 * np.abs(expected.moments.J0).max())
    own = np.linalg.norm(expected.interface("right").Psi, axis=0)
    assert_allclose(np.linalg.norm(body.interface("right").Psi, axis=0), own, rtol=1e-7, atol=1e-7 * own.max())
    if key != "exudyn":
        back = cms.exchange.import_body(
            written(soft, key, tmp_path), units=soft.units, interfaces=names_of(soft, key), frame=cms.NodalFrame("left")
        )
        assert_allclose(np.diag(back.K), np.diag(soft.K), rtol=1e-8)


def in_modes(body, T):
    """Return a reduced body as one of another program whose modes are Phi T, with what a file may hold besides."""
    rng, n = np.random.default_rng(8), len(body.nodes)
    rotations = rng.normal(size=(n, 3, body.n_q))
    loads = symmetric(rng.normal(size=(n, 6, body.n_q, body.n_q)))
    geometric = replace(body.geometric, interfaces=loads, is_loaded=(), turned=None, spread=None)
    left = body.interface("left")
    interfaces = (
        ForeignInterface("left", body.node_ids[left.members][:1], left.position, left.triad, left.Psi @ T),
        ForeignInterface("corner", body.node_ids[-1:]),
    )
    return ModalBody(
        "other", T.T @ T, T.T @ body.K @ T, T.T @ symmetric(body.D + 0.1 * rng.normal(size=T.shape)) @ T,
        changed(body.moments, T), body.node_ids, body.nodes, body.Phi @ T, rotations @ T, body.stress @ T, body.surface,
        interfaces, tuple(replace(case, h=T.T @ case.h) for case in body.load_cases), geometric.transformed(T),
    )  # fmt: skip


def symmetric(A):
    return A + np.swapaxes(A, -1, -2)


@pytest.mark.parametrize("seed", range(3))
def test_any_modes_of_the_same_span_are_the_same_body(seed):
    """Modes that are neither orthonormal nor of one size: all that is linear or quadratic in them is carried along."""
    part = bar(nx=4, width=0.07, height=0.04)
    part = cms.couple(part.with_load_cases(nodal_load(part, "push", {17: np.array([3.0, -5.0, 4.0])})))
    body = cms.reduce(part, cms.craig_bampton(part, n_modes=2), damping=cms.reduction.ModalDamping(0.01))
    rng = np.random.default_rng(seed)
    T = rng.normal(size=(body.n_q, body.n_q)) * 10 ** rng.uniform(-2, 2, size=body.n_q)
    options = ImportOptions(units=body.units)
    own, other = (body_of_modes(in_modes(body, each), options) for each in (np.eye(body.n_q), T))
    assert own.frame.kind == other.frame.kind == "tisserand"
    values = [
        {
            "K": np.diag(each.K), "M": each.M, "D": each.D, "Phi": each.Phi, "stress": each.stress,
            "free": each.free_frequencies, "h": each.load_cases[0].h,
            "C1": each.moments.C1 * 1e3, "P": each.moments.P, "S_kl": each.moments.S_kl, "J0": each.moments.J0,
            "spin": each.geometric.spin, "rotation": each.geometric.rotation, "loads": each.geometric.interfaces,
            "left": each.interface("left").Psi, "corner": each.interface("corner").Psi,
        }
        for each in (own, other)
    ]  # fmt: skip
    for name, expected in values[0].items():
        size = max(np.abs(expected).max(), 1.0) if name == "C1" else np.abs(expected).max()
        assert_allclose(values[1][name], expected, rtol=0, atol=1e-6 * size, err_msg=name)
    assert_allclose(np.diag(own.K), np.diag(body.K), rtol=1e-9)
    assert "mode" in other.labels[0]


def test_stress_and_surface_come_back_from_mbsim(mean, tmp_path):
    body = cms.exchange.import_body(written(mean, "mbsim", tmp_path), units="mm-t-s")
    flip = np.sign(np.einsum("ak,ak->k", body.interface("left").Psi[:3], mean.interface("left").Psi[:3]))
    n = len(mean.nodes)
    assert_allclose(body.stress[:n] * flip, mean.stress, rtol=0, atol=1e-8 * np.abs(mean.stress).max())
    assert_allclose(body.Phi[: 3 * n] * flip, mean.Phi, rtol=0, atol=1e-8 * np.abs(mean.Phi).max())
    assert np.array_equal(body.surface, mean.surface)


def altered_h5(path, change):
    with h5py.File(path, "r+") as file:
        change(file)
    return path


def test_damage_of_mbsim_files_is_told(mean, tmp_path):
    def refused(change, words):
        path = altered_h5(shutil.copy(whole, tmp_path / "bad.h5"), change)
        with pytest.raises(ForeignBodyError, match=words):
            cms.exchange.import_body(path, units="mm-t-s")

    def put(file, name, values):
        del file[name]
        file[name] = values

    whole = written(mean, "mbsim", tmp_path)
    n = mean.n_q
    refused(lambda f: f.__delitem__("position shape function integral"), "function integral' is missing")
    refused(lambda f: put(f, "stiffness matrix", np.eye(n + 1)), "expected shape")
    refused(lambda f: put(f, "stiffness matrix", np.ones((n, 2))), "expected a square matrix")
    refused(lambda f: put(f, "mass", -1.0), "expected a mass above zero")
    blocks = np.concatenate([mean.moments.S_kl[a, b] for a, b in ((0, 1), (0, 0), (0, 2), (1, 2), (1, 1), (2, 2))])
    refused(lambda f: put(f, "stiffness matrix", np.triu(np.ones((n, n)))), "expected a symmetric matrix")
    refused(lambda f: put(f, "shape function shape function integral", blocks), r"symmetric|integrals")
    refused(lambda f: put(f, "stiffness matrix", np.zeros((n, n))), "expected modes with mass and stiffness")

    def hostile(file):
        del file["nodal stress matrix"]
        file.create_dataset("nodal stress matrix", shape=(10**9, 10**3), chunks=(1000, 1000), dtype="f8")

    refused(hostile, "declares 8000000000000 bytes but contains 0")
    content = whole.read_bytes()
    (tmp_path / "cut.h5").write_bytes(content[: len(content) // 2])
    with pytest.raises((ForeignBodyError, ValueError)):
        cms.exchange.import_body(tmp_path / "cut.h5", units="mm-t-s", form="mbsim")


def test_an_unknown_node_as_an_interface_is_told(mean, tmp_path):
    path = written(mean, "mbdyn", tmp_path)
    with pytest.raises(ForeignBodyError, match=r"expected nodes of the file, which are 1, 2; got \[9\]"):
        cms.exchange.import_body(path, units="mm-t-s", interfaces={"a": [9]})


@pytest.mark.parametrize(
    ("key", "pattern", "to", "words"),
    [
        ("mbdyn", r"RECORD GROUP 10,", "RECORD GROUP 110,", "record group 10 is missing"),
        ("mbdyn", r"REV0 2 (\d+)", r"REV0 3 \1", "record group 2: expected 3 nodes, got 2"),
        ("mbdyn", r"REV0 2", "REV0 x", "expected a whole number, got 'x'"),
        ("mbdyn", r"RECORD GROUP 9,", "RECORD GROUP 10,", "record group 10 is there twice"),
        ("mbdyn", r"RECORD GROUP 14,", "RECORD GROUP 114,", "neither record groups 12, 14 and 15"),
        ("sid_fem", r"end modal", "", "it is truncated"),
        ("sid_fem", r"\bKe\n", "Kf\n", "Ke is missing|expected"),
        ("sid_fem", r"m0\( 1, 1\)", "m0( 0, 1)", "expected two indices from 1"),
        ("sid_fem", r"(mass +=).*", r"\1 abc", "expected a number, got 'abc'"),
    ],
)
def test_damage_of_text_files_is_told(mean, tmp_path, key, pattern, to, words):
    path = written(mean, key, tmp_path)
    text = path.read_text()
    changed = re.sub(pattern, to, text, count=1)
    assert changed != text
    path.write_text(changed)
    with pytest.raises((ForeignBodyError, BodyError), match=words):
        cms.exchange.import_body(path, units="mm-t-s", form=key)


def test_the_index_order_of_a_sid_file_is_told_or_asked(mean, tmp_path):
    """Both orders read alike; a file that is taken for the other is refused."""
    first, second = (
        cms.exchange.import_body(written(mean, key, tmp_path), units="mm-t-s") for key in ("sid_fem", "sid_fem-fembeam")
    )
    assert "m1(row, q, column)" in first.provenance["note 1"]
    assert "m1(row, column, q)" in second.provenance["note 1"]
    assert_allclose(first.moments.C3, second.moments.C3, rtol=0, atol=1e-12 * np.abs(first.moments.C3).max())
    path = written(mean, "sid_fem", tmp_path)
    with pytest.raises(ForeignBodyError, match=r"index order m1\(row, q, column\), not"):
        cms.exchange.import_body(path, units="mm-t-s", form="sid_fem-fembeam")


def test_the_other_order_of_the_columns_of_ge_is_told_by_cr(mean, tmp_path):
    path = written(mean, "sid_fem", tmp_path)
    expected = cms.exchange.import_body(path, units="mm-t-s")
    n, lines, inside = mean.n_q, [], False
    for line in path.read_text().splitlines():
        inside = (inside or line.strip() == "Ge") and line.strip() != "end Ge"
        if inside and (found := re.search(r"m0\( *(\d+), *(\d+)\)", line)):
            k, axis = divmod(int(found[2]) - 1, 3)
            line = line.replace(found[0], f"m0({int(found[1]):2d},{axis * n + k + 1:2d})")
        lines.append(line)
    path.write_text("\n".join(lines) + "\n")
    body = cms.exchange.import_body(path, units="mm-t-s")
    assert any("axis*n+k" in value for value in body.provenance.values())
    assert_allclose(body.moments.C4, expected.moments.C4, rtol=0, atol=1e-12 * np.abs(expected.moments.C4).max())


def test_a_file_without_the_second_order_of_inertia_lacks_5c(mean, tmp_path):
    path = written(mean, "sid_fem", tmp_path)
    text = path.read_text()
    begin, end = text.index("Gr\n"), text.index("end Gr")
    part = re.sub(r"\n *m1\(.*", "", text[begin:end])
    path.write_text(text[:begin] + re.sub(r"(order +=) +1", r"\1    0", part) + text[end:])
    body = cms.exchange.import_body(path, units="mm-t-s")
    assert body.moments.missing == ("5C",)
    assert_allclose(np.abs(body.moments.C3), np.abs(mean.moments.C3), rtol=0, atol=1e-7 * np.abs(mean.moments.C3).max())


def test_archives_of_exudyn_never_open_pickled_objects(mean, tmp_path):
    path = written(mean, "exudyn", tmp_path)
    with np.load(path, allow_pickle=True) as archive:
        arrays = {key: archive[key] for key in archive.files}
    np.savez(tmp_path / "evil.npz", **{**arrays, "xRef": np.array([object()], dtype=object)})
    with pytest.raises(ForeignBodyError, match=r"damaged|numbers"):
        cms.exchange.import_body(tmp_path / "evil.npz", units="mm-t-s")
    del arrays["mPsiTildePsiTilde"]
    np.savez(tmp_path / "short.npz", **arrays)
    with pytest.raises(ForeignBodyError, match="'mPsiTildePsiTilde' is missing"):
        cms.exchange.import_body(tmp_path / "short.npz", units="mm-t-s")


def test_a_sign_that_two_statements_deny_is_refused(mean, tmp_path):
    path = written(mean, "exudyn", tmp_path)
    with np.load(path, allow_pickle=True) as archive:
        arrays = {key: archive[key] for key in archive.files}
    np.savez(path, **{**arrays, "mPsiTildePsiTilde": -arrays["mPsiTildePsiTilde"]})
    with pytest.raises(ForeignBodyError, match="trace of 5C differ"):
        cms.exchange.import_body(path, units="mm-t-s")


def test_a_superelement_of_openfast_comes_back(tmp_path):
    part = cms.couple(replace(bar(nx=4), interfaces=bar(nx=4).interfaces[:1]))
    own = cms.reduce(part, cms.craig_bampton(part, n_modes=4), geometric=False, stress=False)
    path = tmp_path / "platform.dat"
    export_body(own, path, to="ext_ptfm", units=own.units)
    place = own.frame.origin + own.frame.axes @ own.interface("left").position
    body = cms.exchange.import_body(path, units="m-kg-s", nodes={1: place})
    assert_allclose(body.free_frequencies, own.free_frequencies, rtol=1e-8)
    assert_allclose(body.moments.J0, own.moments.J0, rtol=0, atol=1e-8 * np.abs(own.moments.J0).max())
    assert body.moments.missing == ("3C", "4C", "5C")
    assert [i.name for i in body.interfaces] == ["node 1"]
    assert "placed at the origin" in cms.exchange.import_body(path, units="m-kg-s").provenance["note 1"]
    text = path.read_text()
    n = 6 + 4
    for pattern, to, words in (
        ("!Stiffness Matrix", "!Other Matrix", "stiffness matrix is missing"),
        (f"!Dimension: {n}\n ", f"!Dimension: {n + 1}\n ", "line 18: could not convert"),
        (f"!Dimension: {n}\n ", "!Dimension: 90000000\n ", "are too many for a reduced body"),
        (r"\de\+0\d", "x", "could not convert"),
    ):
        changed = re.sub(pattern, to, text, count=1)
        assert changed != text
        path.write_text(changed)
        with pytest.raises(ForeignBodyError, match=words):
            cms.exchange.import_body(path, units="m-kg-s")


@pytest.mark.parametrize("key", ["mbdyn", "sid_fem", "sid_fem-fembeam"])
def test_geometric_stiffness_comes_back(key, tmp_path):
    part = cms.couple(bar(nx=3, width=0.07, height=0.04))
    own = cms.reduce(part, cms.craig_bampton(part, n_modes=1), stress=False)
    path = written(own, key, tmp_path)
    body = cms.exchange.import_body(path, units=own.units, interfaces=names_of(own, key))
    flip = np.sign(np.einsum("ak,ak->k", body.interface("left").Psi[:3], own.interface("left").Psi[:3]) + 1e-300)
    signs = flip[:, None] * flip
    for name in ("spin", "rotation", "interfaces", "translation"):
        expected = getattr(own.geometric, name)
        size = max(np.abs(expected).max(), 1e-6 * np.abs(own.geometric.interfaces).max())
        assert_allclose(getattr(body.geometric, name) * signs, expected, rtol=0, atol=1e-6 * size)
    together = cms.exchange.import_body(path, units=own.units, interfaces={"both": [1, 2]})
    assert together.geometric is None


def test_the_momentum_of_modes_does_not_depend_on_where_the_origin_lies():
    """Angular momentum about the centre of mass over the inertia there, of modes that turn more than they move."""
    part = cms.couple(bar(nx=4, width=0.07, height=0.04))
    modes = cms.craig_bampton(part, n_modes=2)
    found = []
    for origin in (None, (3.0, -2.0, 5.0), (30.0, 40.0, 0.0)):
        moments = cms.reduce(part, modes, frame=cms.NodalFrame("left", origin), geometric=False).moments
        c = moments.center_of_mass
        angular = np.linalg.norm(moments.C2 - np.cross(c, moments.C1, axis=0), axis=0)
        central = np.trace(moments.J0 + moments.m * (np.outer(c, c) - c @ c * np.eye(3))) / 2
        turning = angular / np.sqrt(central) - np.linalg.norm(moments.C1, axis=0) / np.sqrt(moments.m)
        k = int(np.argmax(turning))  # a mode that turns more than it moves
        assert turning[k] > 0.05
        found.append(momentum_of(changed(moments, np.diag(1.0 * (np.arange(moments.n_q) == k)))))
        assert_allclose(found[-1], angular[k] / np.sqrt(central), rtol=1e-8)
    assert_allclose(found, found[0], rtol=1e-6)

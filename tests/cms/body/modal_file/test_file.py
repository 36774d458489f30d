import os
import re
import resource
import subprocess
import sys
from dataclasses import fields, is_dataclass, replace
from functools import cache
from pathlib import Path

import h5py
import numpy as np
import pytest

from cms.body.invariants import Moments
from cms.body.modal_file import content as modal_content
from cms.body.modal_file import file as modal_file
from cms.body.modal_file.content import body_of, content_of
from cms.body.modal_file.contents import Dataset
from cms.body.modal_file.file import VERSION, convert_units, digest, read, write
from cms.body.modal_file.schema import GROUPS
from cms.body.reduced_body import ReducedBody
from cms.errors import BodyError, ModalFileError, UnitsError
from cms.modes.mode_sets import craig_bampton
from cms.reduction.basis.damping import RampDamping
from cms.reduction.basis.frames import NodalFrame
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import Interface
from fe_models.body.loads import gravity_load, interface_load
from fe_models.body.material import Material
from fe_models.elements.solids.body import solid_body
from fe_models.foundation.units import UNIT_SYSTEMS, unit_system
from tests.bodies import box_mesh, distorted
from tests.cms.body.modal_file.examples import differences
from tests.root import ROOT
from tests.synthetic import synthetic_reduced_body


@pytest.fixture(scope="module")
def body() -> ReducedBody:
    return synthetic_reduced_body()


@pytest.fixture
def path(body, tmp_path) -> Path:
    write(body, tmp_path / "rod.h5")
    return tmp_path / "rod.h5"


@pytest.mark.parametrize("n_q", [0, 1, 5])
def test_reading_returns_what_was_written_bit_for_bit(tmp_path, n_q):
    body = synthetic_reduced_body(n_q=n_q)
    write(body, tmp_path / "a.h5")
    assert differences(body, read(tmp_path / "a.h5")) == []


def test_what_a_body_lacks_stays_absent(body, tmp_path):
    bare = replace(body, columns=None, nodal_sums=None, load_cases=(), stress=None, point_stress=None,
                   frame=replace(body.frame, dofs=np.zeros((0, 2), int)),
                   interfaces=[replace(i, has_rotation=False) for i in body.interfaces])  # fmt: skip
    write(bare, tmp_path / "a.h5")
    assert differences(bare, read(tmp_path / "a.h5")) == []


def test_a_file_of_version_1_is_read_as_it_was_written():
    """Written by the program of that version from the same point masses."""
    old = read(ROOT / "tests" / "cms" / "body" / "modal_file" / "data" / "version_1.h5")
    new = synthetic_reduced_body(n_q=2, n_nodes=10)
    bare = replace(new, columns=None, nodal_sums=None, load_cases=(), stress=None, point_stress=None,
                   frame=replace(new.frame, dofs=np.zeros((0, 2), int)))  # fmt: skip
    for made, read_ in zip(bare.interfaces, old.interfaces, strict=True):  # by a QR, whose last bits differ by machine
        np.testing.assert_allclose(read_.triad, made.triad, rtol=0, atol=1e-15)
    same = [replace(each, triad=other.triad) for each, other in zip(bare.interfaces, old.interfaces, strict=True)]
    assert differences(replace(bare, interfaces=same), old) == []


@cache
def bar_in(units):
    """Return a reduced bar of 1 m in a unit system."""
    metre = 1 / units.to_si(length=1)
    newton = 1 / units.to_si(mass=1, length=1, time=-2)
    mesh = distorted(box_mesh(4, 1, 1, 1.0, 0.08, 0.05, "hexahedron"), amount=0.2)
    mesh = replace(mesh, nodes=mesh.nodes * metre)
    steel = Material("steel", E=2.1e11 * newton / metre**2, nu=0.3, rho=7850.0 / units.to_si(mass=1, length=-3))
    ends = [Interface(n, k, mesh.node_sets[n], np.array([x, 0.03, 0.02]) * metre)
            for n, k, x in (("left", "rigid", 0.0), ("right", "distributing", 1.02))]  # fmt: skip
    body = solid_body(mesh, steel, name="bar", units=units, interfaces=ends)
    fall = np.array([1.0, 2.0, -9.81]) / units.to_si(length=1, time=-2)
    wrench = {"force": np.array([5.0, 1, 2]) * newton, "torque": np.ones(3) * newton * metre}
    pull = interface_load(body, "pull", "right", **wrench)
    body = couple(body.with_load_cases(gravity_load(body, "weight", fall), pull))
    held = ((1, 0), (1, 1), (1, 2), (18, 1), (18, 2), (2, 0))  # so that nothing vanishes that is compared
    frame = NodalFrame(dofs=held, origin=tuple(np.array([0.1, 0.2, 0.3]) * metre))
    return reduce(body, craig_bampton(body, n_modes=3), frame=frame, damping=RampDamping())


@pytest.mark.parametrize("system", ["m-kg-s", "in-slinch-s", "mm-g-ms"])
def test_a_body_in_other_units_is_that_of_the_model_in_those_units(system):
    """The same steel bar built, loaded, damped and reduced in two unit systems."""
    made = [bar_in(unit_system(name)) for name in ("mm-t-s", system)]
    converted = convert_units(made[0], system)
    assert converted.units == made[1].units
    sign = np.sign(np.einsum("nck,nck->k", converted.Phi, made[1].Phi))
    assert len(compare(converted, made[1], sign)) == 63


def compare(a, b, sign, where="body"):
    """Compare every array of two bodies, but for the signs of modes (the last axes of length n_q); return the names."""
    names = []
    for field in fields(a):
        x, y, name = getattr(a, field.name), getattr(b, field.name), f"{where}.{field.name}"
        if field.name in ("provenance", "units", "labels"):
            continue
        if is_dataclass(x):
            names += compare(x, y, sign, name)
        elif isinstance(x, tuple) and x and is_dataclass(x[0]):
            for k, pair in enumerate(zip(x, y, strict=True)):
                names += compare(*pair, sign, f"{name}[{k}]")
        elif isinstance(x, np.ndarray | float):
            y = np.array(y, dtype=float)
            for axis in range(y.ndim if "freq" not in name else 0):  # the axes of modes
                if y.shape[axis] == len(sign) and (axis == y.ndim - 1 or y.shape[-2:] == (len(sign), len(sign))):
                    y = y * sign.reshape([-1 if k == axis else 1 for k in range(y.ndim)])
            scale = np.abs(y).max(initial=0.0) or 1.0
            np.testing.assert_allclose(np.asarray(x) / scale, y / scale, rtol=0, atol=1e-8, err_msg=name)
            names.append(name)
        else:
            assert x == y, name
    return names


def test_units_on_reading_and_back(body, tmp_path):
    write(body, tmp_path / "a.h5")
    assert differences(body, read(tmp_path / "a.h5", units="mm-t-s")) == []
    metres = read(tmp_path / "a.h5", units="m-kg-s")
    assert metres.units.name == "m-kg-s"
    assert metres.provenance["units converted from"] == "mm-t-s"
    np.testing.assert_allclose(metres.moments.m, body.moments.m * 1e3, rtol=1e-15)
    np.testing.assert_allclose(metres.nodes, body.nodes / 1e3, rtol=1e-15)
    back = convert_units(metres, body.units)
    for name in ("Phi", "K", "stress"):
        np.testing.assert_allclose(getattr(back, name), getattr(body, name), rtol=1e-14)
    with pytest.raises(UnitsError, match="did you mean 'm-kg-s'"):
        read(tmp_path / "a.h5", units="m-kgs")


def test_the_energy_of_a_motion_is_the_same_in_all_units(body):
    """q̇ᵀ M q̇, qᵀ K q, q̇ᵀ D q (times the time unit) and h·q are joules, with q in mass^(1/2) length."""
    rng = np.random.default_rng(4)
    q, q_dot = rng.normal(size=(2, body.n_q))
    joules = []
    for name in UNIT_SYSTEMS:
        other = convert_units(body, name)
        u = other.units
        unit_q = np.sqrt(u.mass / body.units.mass) * u.length / body.units.length
        x, x_dot = q / unit_q, q_dot / unit_q * u.time / body.units.time
        works = [case.h @ x for case in other.load_cases]
        joules.append(np.array([x_dot @ other.M @ x_dot, x @ other.K @ x, x_dot @ other.D @ x, *works]))
        joules[-1] *= u.to_si(mass=1, length=2, time=-2)
    for energies in joules[1:]:
        np.testing.assert_allclose(energies, joules[0], rtol=1e-12)


def test_sums_of_nodes_that_count_one_keep_their_count_in_other_units(body):
    counted = convert_units(replace(body, nodal_sums=replace(body.nodal_sums, is_volume=False)), "m-kg-s").nodal_sums
    assert counted.w == body.nodal_sums.w
    np.testing.assert_allclose(counted.S, np.asarray(body.nodal_sums.S) * 1e-3, rtol=1e-14)
    by_volume = convert_units(body, "m-kg-s").nodal_sums
    np.testing.assert_allclose(by_volume.S, np.asarray(body.nodal_sums.S) * 1e-12, rtol=1e-14)


def test_odd_numbers_survive(body, tmp_path):
    odd = np.array([-0.0, 5e-324, 1.7976931348623157e308, 1 / 3, np.pi])
    body = replace(body, free_frequencies=odd, surface=np.zeros((0, 3), int))
    write(body, tmp_path / "a.h5")
    assert differences(body, read(tmp_path / "a.h5")) == []


def test_the_same_body_gives_the_same_file_and_another_body_another_digest(body, tmp_path):
    write(body, tmp_path / "a.h5")
    write(synthetic_reduced_body(), tmp_path / "b.h5")
    write(replace(body, labels=(*body.labels[:-1], "renamed")), tmp_path / "c.h5")
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()
    assert digest(tmp_path / "a.h5") == digest(tmp_path / "b.h5")
    assert digest(tmp_path / "a.h5") != digest(tmp_path / "c.h5")
    with h5py.File(tmp_path / "a.h5") as file:
        assert not file["modes/K"].id.get_create_plist().get_obj_track_times()


def test_every_flipped_byte_is_detected(path):
    whole = path.read_bytes()
    rng = np.random.default_rng(1)
    positions = np.unique(
        np.concatenate([np.arange(200), [511, 512, 513, len(whole) - 1], rng.integers(0, len(whole), 400)])
    )
    for position in positions:
        damaged = bytearray(whole)
        damaged[position] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        with pytest.raises(ModalFileError):
            read(path)


def test_every_truncation_is_detected(path):
    whole = path.read_bytes()
    for n_bytes in [0, 1, 20, 100, 511, 512, 513, 520, 1000, len(whole) // 2, len(whole) - 1]:
        path.write_bytes(whole[:n_bytes])
        with pytest.raises(ModalFileError, match=r"truncated|not a modal-file"):
            read(path)
    path.write_bytes(whole + b"\0")
    with pytest.raises(ModalFileError, match="altered"):
        read(path)


def repacked(path: Path) -> Path:
    """Return a copy of the file as HDF5 tools would write it: the same contents, no seal."""
    target = path.with_name("repacked.h5")
    with h5py.File(path) as old, h5py.File(target, "w") as new:
        for name in old:
            old.copy(name, new)
        for name, value in old.attrs.items():
            new.attrs.create(name, value, dtype=old.attrs.get_id(name).dtype)
    return target


def test_a_repacked_file_reads_the_same(body, path):
    assert differences(body, read(repacked(path))) == []
    assert digest(repacked(path)) == digest(path)


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda f: f["modes/K"].write_direct(np.zeros((5, 5))), "dataset /modes/K"),
        (lambda f: f["modes"].attrs.create("note", 1.0), "digest"),
        (lambda f: f["units"].attrs.modify("length", 1.0), "digest"),
        (lambda f: f["modes/K"].attrs.modify("unit", np.bytes_(b"kN")), "digest"),
        (lambda f: f.move("modes/D", "modes/E"), "digest"),
        (lambda f: f["interfaces"].move("0", "7"), "digest"),
        (lambda f: f.__delitem__("surface/triangles"), "digest"),
        (lambda f: f["modes/K"].attrs.__delitem__("sha256"), "dataset /modes/K"),
        (lambda f: f.attrs.__delitem__("digest"), "digest"),
        (lambda f: f.attrs.modify("digest", np.bytes_(b"0" * 64)), "digest"),
    ],
)
def test_a_change_through_hdf5_is_detected_without_the_seal(path, damage, words):
    copy = repacked(path)
    with h5py.File(copy, "r+") as file:
        damage(file)
    for use in (read, digest):
        with pytest.raises(ModalFileError, match=words):
            use(copy)


def test_a_sealed_file_of_another_kind_is_called_what_it_is(path):
    whole = path.read_bytes()
    path.write_bytes(whole.replace(b"floatframe modal-file ", b"floatframe results-file ", 1))
    with pytest.raises(ModalFileError, match="expected a modal-file, got a results-file; a modal-file is written by"):
        read(path)


def test_a_change_through_hdf5_breaks_the_seal(path):
    with h5py.File(path, "r+") as file:
        file["modes/K"][0, 0] += 1.0
    for use in (read, digest):
        with pytest.raises(ModalFileError, match="altered"):
            use(path)


@pytest.mark.parametrize("n", [15, pytest.param(40, marks=pytest.mark.long)])
def test_flipped_bytes_in_the_data_of_a_repacked_file_are_detected(path, n):
    """The seal is gone, so this is the work of the sha256 of each dataset."""
    copy = repacked(path)
    whole = copy.read_bytes()
    with h5py.File(copy) as file:  # flips in the structure may upset HDF5 itself: the seal is there for that
        spans = [(d.id.get_offset(), d.id.get_storage_size()) for d in (file["nodes/Phi"], file["moments/S_kl"])]
    rng = np.random.default_rng(2)
    for start, size in spans:
        for position in start + rng.integers(0, size, n):
            damaged = bytearray(whole)
            damaged[position] ^= 1 << rng.integers(8)
            copy.write_bytes(damaged)
            with pytest.raises(ModalFileError, match="sha256"):
                read(copy)


def test_other_files_are_refused_with_words(tmp_path, path):
    (tmp_path / "text.h5").write_text("not at all")
    with pytest.raises(ModalFileError, match="not a modal-file: expected an HDF5 file"):
        read(tmp_path / "text.h5")
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = 1.0
    with pytest.raises(ModalFileError, match="HDF5 of another program"):
        read(tmp_path / "other.h5")
    with pytest.raises(ModalFileError, match=r"no such file; did you mean 'rod.h5'"):
        read(tmp_path / "rot.h5")
    with pytest.raises(ModalFileError, match="cannot be read"):
        read(tmp_path)


def test_a_large_file_that_is_not_made_in_memory_first_says_the_same(body, tmp_path, monkeypatch):
    write(body, tmp_path / "small.h5")
    monkeypatch.setattr("cms.body.modal_file.file.LARGE", 0)
    (tmp_path / "link.h5").symlink_to(tmp_path / "large.h5")
    write(body, tmp_path / "link.h5")
    assert (tmp_path / "link.h5").is_symlink()
    assert (tmp_path / "large.h5").read_bytes() == (tmp_path / "small.h5").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["large.h5", "link.h5", "small.h5"]
    with pytest.raises(ModalFileError, match=r"cannot be written: .*nothing was written"):
        write(body, tmp_path / "nowhere" / "body.h5")


def test_a_newer_version_is_refused_by_its_number(body, tmp_path, monkeypatch):
    monkeypatch.setattr(modal_file, "version_of", lambda reduced: modal_file.VERSION + 1)
    write(body, tmp_path / "new.h5")
    monkeypatch.undo()
    for file in (tmp_path / "new.h5", repacked(tmp_path / "new.h5")):
        with pytest.raises(ModalFileError, match="format version 7, this program reads versions up to 6"):
            read(file)
    (tmp_path / "new.h5").write_bytes(b"floatframe modal-file 12\nbytes 9\nof a kind that does not exist yet")
    with pytest.raises(ModalFileError, match="format version 12"):
        read(tmp_path / "new.h5")


def written_with(content, path):
    modal_file.write_sealed(content, path)
    return read(path)


def test_a_missing_dataset_and_a_wrong_invariant_are_refused_even_when_sealed(body, tmp_path):
    content = modal_content.content_of(body, modal_file.VERSION)
    for name in ("/modes/M", "/nodes/Phi", "/interfaces/1/Psi", "/invariants/C3", "/frame/dofs", "/load_cases/1/h",
                 "/stress/nodal", "/stress/points/names", "/columns/F", "/nodal_sums/U2"):  # fmt: skip
        rest = {path: d for path, d in content.datasets.items() if path != name}
        with pytest.raises(ModalFileError, match=f"dataset {name} is missing"):
            written_with(replace(content, datasets=rest), tmp_path / "a.h5")
    flipped = {**content.datasets, "/invariants/C4": Dataset(-body.moments.C4)}
    with pytest.raises(ModalFileError, match="/invariants/C4 does not follow from the moments"):
        written_with(replace(content, datasets=flipped), tmp_path / "a.h5")
    short = {**content.datasets, "/modes/K": Dataset(body.K[:2])}
    with pytest.raises(ModalFileError, match=r"a\.h5: .*expected shape"):
        written_with(replace(content, datasets=short), tmp_path / "a.h5")
    bad = {**content.datasets, "/nodes/Phi": Dataset(body.Phi * np.nan)}
    with pytest.raises(ModalFileError, match="expected finite numbers"):
        written_with(replace(content, datasets=bad), tmp_path / "a.h5")
    units = {**content.attributes, "/units": {**content.attributes["/units"], "length": 1.0}}
    with pytest.raises(ModalFileError, match="expected the factors of this system"):
        written_with(replace(content, attributes=units), tmp_path / "a.h5")


def test_text_with_a_zero_byte_is_refused_before_writing(body, tmp_path):
    with pytest.raises(ModalFileError, match="zero bytes"):
        write(replace(body, name="rod\0"), tmp_path / "a.h5")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("raised", [KeyboardInterrupt, OSError(28, "No space left on device"), MemoryError])
@pytest.mark.parametrize("when", ["fsync", "replace"])
def test_an_interrupted_write_leaves_the_old_file(body, path, monkeypatch, raised, when):
    def fail(*_):
        raise raised

    old = path.read_bytes()
    monkeypatch.setattr(os, when, fail)
    with pytest.raises((ModalFileError, KeyboardInterrupt, MemoryError)) as caught:
        write(synthetic_reduced_body(seed=1), path)
    monkeypatch.undo()
    if isinstance(raised, OSError):
        assert "No space left on device; the file that was there is unchanged" in str(caught.value)
    assert path.read_bytes() == old
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_a_write_beyond_the_file_size_limit_leaves_the_old_file(path):
    old = path.read_bytes()
    script = (
        "import resource, sys; from tests.synthetic import synthetic_reduced_body\n"
        "import cms.body.modal_file.file as m\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192))\n"
        "try: m.write(synthetic_reduced_body(seed=1), sys.argv[1])\n"
        "except m.ModalFileError as e: print(e); sys.exit(2)"
    )
    run = subprocess.run(
        [sys.executable, "-c", script, path],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": "."},
    )
    assert run.returncode == 2, run.stderr
    assert "cannot be written: File too large; the file that was there is unchanged" in run.stdout
    assert path.read_bytes() == old
    assert [p.name for p in path.parent.iterdir()] == [path.name]
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] != 8192


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full, the full disk of the system")
def test_a_full_disk_leaves_the_old_file(path, monkeypatch):
    old, real_open = path.read_bytes(), os.open

    def open_full_disk(name, flags, mode=0o777):
        if not str(name).endswith(".part"):
            return real_open(name, flags, mode)
        os.close(real_open(name, flags, mode))
        return real_open("/dev/full", os.O_WRONLY)

    monkeypatch.setattr(os, "open", open_full_disk)
    with pytest.raises(ModalFileError, match="No space left on device; the file that was there is unchanged"):
        write(synthetic_reduced_body(seed=1), path)
    assert path.read_bytes() == old
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_a_missing_folder_is_named(body, tmp_path):
    with pytest.raises(ModalFileError, match="No such file or directory; nothing was written"):
        write(body, tmp_path / "nowhere" / "rod.h5")


def test_a_link_stays_a_link(body, path, tmp_path):
    link = tmp_path / "link.h5"
    link.symlink_to(path)
    write(synthetic_reduced_body(seed=3), link)
    assert link.is_symlink()
    assert differences(synthetic_reduced_body(seed=3), read(path)) == []


def test_every_dataset_has_a_unit_and_a_description(path):
    with h5py.File(path) as file:
        names = []
        file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        for name in names:
            assert file[name].attrs["unit"].decode()
            assert file[name].attrs["description"].decode()


def test_every_attribute_of_a_group_is_declared_with_its_type(path):
    numbers = {str: "S", int: "i", bool: "i", float: "f"}
    found = {}

    def visit(name, item):
        if isinstance(item, h5py.Group) and name != "/provenance":
            found.update({(name, key): item.attrs[key].dtype.kind for key in item.attrs if key != "count"})

    with h5py.File(path) as file:
        visit("/", file)
        file.visititems(lambda name, item: visit(f"/{name}", item))
    declared = {
        group: {name: numbers[kind] for name, (kind, _) in each.attributes.items()} for group, each in GROUPS.items()
    }
    general = {key: re.sub(r"/\d+$", "/<i>", key[0]) for key in found}
    assert {key: declared[general[key]].get(key[1]) for key in found} == found


@pytest.mark.parametrize(
    ("path", "values", "words"),
    [
        ("/modes/K", np.eye(2), r"dataset /modes/K: expected shape \(5, 5\), got \(2, 2\)"),
        ("/interfaces/0/Psi", np.zeros((3, 5)), r"dataset /interfaces/0/Psi: expected shape \(6, 5\), got \(3, 5\)"),
        ("/columns/A", np.zeros((1, 5)), r"dataset /columns/A: expected shape \(3, 5\), got \(1, 5\)"),
        ("/modes/labels", np.zeros(5), "dataset /modes/labels: expected text, got numbers"),
        ("/modes/M", ("text",), "dataset /modes/M: expected numbers, got text"),
    ],
)
def test_a_dataset_of_another_shape_or_kind_is_named(body, path, values, words):
    content = content_of(body, VERSION)
    datasets = {**content.datasets, path: replace(content.datasets[path], values=values)}
    with pytest.raises((BodyError, ModalFileError), match=words):
        body_of(replace(content, datasets=datasets))


@pytest.mark.parametrize(("sizes", "got"), [({"n_modes": "five"}, "'five'"), ({"n_modes": None}, "nothing")])
def test_a_root_without_the_number_of_modes_is_refused(body, sizes, got):
    content = content_of(body, VERSION)
    root = {name: value for name, value in (content.attributes["/"] | sizes).items() if value is not None}
    with pytest.raises(ModalFileError, match=f"attribute 'n_modes' of /: expected int, got {got}"):
        body_of(replace(content, attributes={**content.attributes, "/": root}))


def test_an_interface_of_version_1_without_shapes_is_refused(body):
    content = content_of(body, 1)
    attributes = {**content.attributes, "/interfaces/0": {"name": "left", "kind": "nodes"}}
    datasets = {path: each for path, each in content.datasets.items() if path != "/interfaces/0/Psi"}
    with pytest.raises(ModalFileError, match="dataset /interfaces/0/Psi is missing"):
        body_of(replace(content, attributes=attributes, datasets=datasets))


def test_units_follow_from_the_unit_system(path):
    with h5py.File(path) as file:
        units = {name: file[name].attrs["unit"].decode() for name in ("nodes/Phi", "moments/P", "modes/K", "moments/R")}
    assert units == {"nodes/Phi": "t^(-1/2)", "moments/P": "t^(1/2) mm", "modes/K": "s^-2", "moments/R": "t mm^2"}


def test_the_specification_of_the_digest_is_complete(path):
    """A second reader, written from docs/modal_file.md with nothing of `cms`."""
    import hashlib

    lines = []

    def line(name, value, kind):
        shape = ",".join(str(n) for n in value.shape)
        if kind.kind == "S":
            data, word = b"".join(bytes(v) + b"\0" for v in np.atleast_1d(value).ravel()), "utf8"
        else:
            data, word = value.tobytes(), {"f": "float64", "i": "int64"}[kind.kind]
        lines.append(f"{name}\t{word}\t{shape}\t{hashlib.sha256(data).hexdigest()}\n")

    def visit(name, item):
        if isinstance(item, h5py.Dataset):
            line(name, np.asarray(item[()]), item.dtype)
        for key in item.attrs:
            if not (isinstance(item, h5py.Dataset) and key == "sha256") and (name, key) != ("/", "digest"):
                value = np.asarray(item.attrs[key])
                line(f"{name}@{key}", value, value.dtype)

    with h5py.File(path) as file:
        visit("/", file)
        file.visititems(lambda name, item: visit(f"/{name}", item))
    mine = hashlib.sha256(b"".join(sorted(text.encode() for text in lines))).hexdigest()
    assert mine == digest(path)


def test_moments_hold_what_the_point_masses_say(body):
    """The synthetic body itself: M* = 1 and m = sum of masses, so that a round trip of it means something."""
    moments: Moments = body.moments
    np.testing.assert_allclose(moments.M, np.eye(5), rtol=0, atol=1e-12)


@pytest.mark.parametrize("count", [-1, 1, 3, 10**9, 2**62])
def test_a_count_that_is_not_that_of_the_groups_is_refused_before_any_work(body, tmp_path, count):
    content = modal_content.content_of(body, modal_file.VERSION)
    attributes = {**content.attributes, "/interfaces": {"count": count}}
    with pytest.raises(ModalFileError, match="attribute 'count' of /interfaces: expected 2, the number of its groups"):
        written_with(replace(content, attributes=attributes), tmp_path / "a.h5")


def test_a_mass_of_several_numbers_is_refused(body, tmp_path):
    content = modal_content.content_of(body, modal_file.VERSION)
    for name in ("/moments/m", "/nodal_sums/w"):
        several = {**content.datasets, name: Dataset(np.ones(2))}
        with pytest.raises(ModalFileError, match=rf"dataset {name}: expected shape \(\)"):
            written_with(replace(content, datasets=several), tmp_path / "a.h5")


@pytest.mark.parametrize("name", ["body.npz", "body.SID_FEM", "body.toml"])
def test_a_name_of_another_kind_of_file_is_refused(tmp_path, name):
    with pytest.raises(ModalFileError, match=r"a modal file ends in \.h5 or \.hdf5, got .*cms export --to"):
        write(synthetic_reduced_body(), tmp_path / name)
    assert list(tmp_path.iterdir()) == []

"""Files with a whole seal whose content is impossible: every number that is none, and places that do not fit."""

from dataclasses import replace

import numpy as np
import pytest

import cms
from cms.assessment.quality.body_check import check_body
from cms.body.modal_file import file as modal_file
from cms.body.modal_file.file import KIND, read, read_sealed, write_sealed
from cms.errors import ModalFileError
from cms.reduction.basis.frames import NodalFrame
from tests.bodies import bar


@pytest.fixture(scope="module")
def content(tmp_path_factory):
    """What a good file says, with a rigid and a distributing interface, and its seal."""
    free = bar(nx=3, ny=2, kind="hexahedron")
    left, right = free.interfaces
    body = cms.couple(replace(free, interfaces=(left, replace(right, kind="distributing"))))
    path = tmp_path_factory.mktemp("good") / "good.h5"
    cms.write(cms.reduce(body, cms.craig_bampton(body, n_modes=2), frame=NodalFrame("left"), geometric=True), path)
    assert [record.name for record in check_body(read(path)) if record.verdict == "fail"] == []
    return read_sealed(path, KIND)


def changed(content, **changes):
    """The content with datasets changed by functions of their values."""
    datasets = dict(content.datasets)
    for path, change in changes.items():
        datasets[path] = replace(datasets[path], values=change(np.array(datasets[path].values)))
    return replace(content, datasets=datasets)


def resealed(content, folder, **changes):
    """The file with this changed content, under a seal of its own."""
    root = {name: value for name, value in content.attributes["/"].items() if name != "digest"}
    attributes = {**content.attributes, "/": root}
    write_sealed(replace(changed(content, **changes), attributes=attributes), folder / "changed.h5")
    return folder / "changed.h5"


def test_the_file_itself_is_read_under_its_new_seal(content, tmp_path):
    """So that what the other tests see refused is refused for its content."""
    assert read(resealed(content, tmp_path)).n_q > 0


def spoilt(values, number):
    values.flat[values.size // 2] = number
    return values


@pytest.mark.parametrize("first", [0, 1])
def test_a_number_that_is_none_is_refused_wherever_it_stands(content, first, monkeypatch):
    """In each of all datasets of numbers, one value: NaN in every other one, infinity in the rest.

    The content is taken as read from the file; the other tests write files.
    """
    accepted = []
    for k, (path, dataset) in enumerate(content.datasets.items(), start=first):
        values = np.asarray(dataset.values)
        if values.dtype.kind != "f" or not values.size or np.isinf(values).any():
            continue
        number = (np.nan, np.inf)[k % 2]
        bad = changed(content, **{path: lambda values, number=number: spoilt(values, number)})
        monkeypatch.setattr(modal_file, "read_sealed", lambda path, kind, bad=bad: bad)
        try:
            read("bad.h5")
        except ModalFileError:
            continue
        accepted.append(path)
    assert accepted == []


@pytest.mark.parametrize("path", ["/frame/axes", "/interfaces/0/triad", "/interfaces/1/triad"])
@pytest.mark.parametrize("change", [lambda A: 0 * A, lambda A: 1.1 * A, lambda A: A + 0.1])
def test_axes_that_are_none_are_refused(content, path, change, tmp_path):
    with pytest.raises(ModalFileError, match="expected orthonormal axes as columns"):
        read(resealed(content, tmp_path, **{path: change}))


def test_a_left_handed_frame_is_refused(content, tmp_path):
    with pytest.raises(ModalFileError, match="expected right-handed axes"):
        read(resealed(content, tmp_path, **{"/frame/axes": lambda A: -A}))


@pytest.mark.parametrize("interface", [0, 1])
@pytest.mark.parametrize("part", ["position", "Psi"])
def test_a_moved_interface_fails_the_check(content, interface, part, tmp_path):
    path = f"/interfaces/{interface}/{part}"
    moved = read(resealed(content, tmp_path, **{path: lambda values: values + 1e-3 * max(np.abs(values).max(), 1.0)}))
    failed = [record.name for record in check_body(moved) if record.verdict == "fail"]
    assert "interface-places" in failed or "frame-condition" in failed


def test_frequencies_for_other_readers_are_those_of_the_matrices(content, tmp_path):
    with pytest.raises(ModalFileError, match="/modes/frequencies does not follow from /modes/K"):
        read(resealed(content, tmp_path, **{"/modes/frequencies": lambda f: 1.01 * f}))


def test_weights_without_a_sum_are_refused(content, tmp_path):
    with pytest.raises(ModalFileError, match="expected a positive sum of weights"):
        read(resealed(content, tmp_path, **{"/nodal_sums/w": lambda w: 0 * w}))

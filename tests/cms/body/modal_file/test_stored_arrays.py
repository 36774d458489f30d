"""How arrays lie in sealed files: compressed where that pays, and bit for bit what was written in either case."""

import h5py
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from cms.body.modal_file.contents import Content, Dataset
from cms.body.modal_file.file import read_sealed, write_sealed
from fe_models.foundation.errors import ModalFileError
from fe_models.foundation.hdf5_file import LARGE, chunk_of
from fe_models.foundation.seal import Kind

KIND = Kind("sample", 1, ModalFileError, "this test")
N = 400  #: 1.28 MB a matrix


@pytest.fixture(scope="module")
def arrays():
    rng = np.random.default_rng(0)
    return {
        "/diagonal": np.diag(rng.uniform(1.0, 2.0, N)),
        "/dense": rng.normal(size=(N, N)),
        "/zeros": np.zeros((3, N, N)),
        "/whole": np.arange(2 * LARGE // 8),
        "/small": np.zeros((10, 10)),
        "/none": np.zeros((0, 3)),
        "/one": np.array(2.5),
    }


@pytest.fixture(scope="module")
def path(arrays, tmp_path_factory):
    path = tmp_path_factory.mktemp("files") / "sample.h5"
    write_sealed(Content("sample", 1, {name: Dataset(values) for name, values in arrays.items()}), path)
    return path


def test_arrays_come_back_bit_for_bit(arrays, path):
    found = read_sealed(path, KIND).datasets
    for name, values in arrays.items():
        assert_array_equal(found[name].values, values, strict=True)


def test_what_deflate_makes_much_smaller_is_compressed_and_nothing_else(path):
    with h5py.File(path) as file:
        compressed = {name for name in file if file[name].compression == "gzip"}
        assert compressed == {"diagonal", "zeros", "whole"}
        stored = {name: file[name].id.get_storage_size() / file[name].nbytes for name in compressed}
    assert stored["diagonal"] < 0.05, stored
    assert stored["zeros"] < 0.02, stored
    assert path.stat().st_size < 1.35 * 8 * N**2  # the dense one and little else


@pytest.mark.parametrize("shape", [(7,), (400, 400), (3, 900, 900), (3, 3, 2000, 2000), (5_000_000,), (1, 1)])
def test_a_chunk_is_part_of_the_array_and_of_bounded_size(shape):
    chunk = chunk_of(shape, 8)
    assert all(1 <= part <= whole for part, whole in zip(chunk, shape, strict=True))
    assert LARGE / 4 <= 8 * np.prod(chunk) <= LARGE or 8 * np.prod(shape) < LARGE

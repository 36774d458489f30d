import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_array_equal

from fe_models.foundation.ranks.ranks import OneRank, RankError, require_agreement, started_ranks
from fe_models.foundation.ranks.rows import PIECE, collected, even_rows, own_rows, spread
from fe_models.foundation.tasks.installation import installation
from tests.thread_ranks import on_threads


def doubled(ranks, value):
    ranks.store["seen"] = value
    return 2 * value


def test_a_process_alone_is_all_ranks():
    ranks = OneRank()
    assert (ranks.rank, ranks.size) == (0, 1)
    assert ranks.everywhere(doubled, 21) == [42]
    assert ranks.store == {"seen": 21}
    ranks.serve()
    ranks.end()


@pytest.mark.parametrize(
    ("name", "text", "n"), [("OMPI_COMM_WORLD_SIZE", "4", 4), ("PMI_SIZE", "2", 2), ("PMI_SIZE", "x", 1)]
)
def test_the_launcher_says_how_many_ranks_there_are(monkeypatch, name, text, n):
    for each in ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS"):
        monkeypatch.delenv(each, raising=False)
    assert started_ranks() == 1
    monkeypatch.setenv(name, text)
    assert started_ranks() == n


class Gathered(OneRank):
    """Rank 0 of two, the other of which has answered already."""

    size = 2

    def __init__(self, other):
        super().__init__()
        self.comm, self.other = self, other

    def allgather(self, own):
        return [own, own | self.other]


def test_ranks_with_the_same_program_and_question_agree():
    require_agreement(OneRank(), ["abc"])
    require_agreement(Gathered({}), ["abc"])


@pytest.mark.parametrize(
    ("other", "words"),
    [
        ({"input 0": "abd"}, "rank 1 of 2 differs from rank 0: input 0: expected abc, got abd"),
        ({"numpy": "1.0"}, f"numpy: expected {installation()['numpy']}, got 1.0"),
    ],
)
def test_ranks_that_disagree_are_named(other, words):
    with pytest.raises(RankError, match=words.replace(".", r"\.")):
        require_agreement(Gathered(other), ["abc"])


@pytest.mark.parametrize("size", [1, 2, 3])
def test_rows_go_to_all_ranks_and_come_back(size):
    x = np.random.default_rng(size).standard_normal((11, 3))
    rows = even_rows(np.arange(12) ** 2, size)
    assert rows.n == 11
    parts = on_threads(size, lambda ranks: own_rows(ranks, rows, x if ranks.rank == 0 else None))
    assert_array_equal(np.concatenate(parts), x)
    back = on_threads(size, lambda ranks: collected(ranks, rows, parts[ranks.rank]))
    assert_array_equal(back[0], x)
    assert back[1:] == [None] * (size - 1)


@pytest.mark.parametrize("size", [1, 2, 3])
def test_compressed_rows_are_shared_by_their_entries(size):
    A = sp.random_array((40, 40), density=0.2, rng=np.random.default_rng(0), format="csr")
    rows = even_rows(A.indptr, size)
    given = (A.indptr, A.indices, A.data)
    parts = on_threads(size, lambda ranks: spread(ranks, rows, given if ranks.rank == 0 else None))
    whole = sp.vstack([
        sp.csr_array((data, indices, indptr), shape=(len(indptr) - 1, 40)) for indptr, indices, data in parts
    ])  # fmt: skip
    assert_array_equal(whole.toarray(), A.toarray())
    assert max(len(data) for *_, data in parts) <= A.nnz / size + A.shape[1]


def test_long_arrays_go_in_pieces(monkeypatch):
    monkeypatch.setattr("fe_models.foundation.ranks.rows.PIECE", 7)
    assert PIECE > 7
    x = np.arange(60.0).reshape(20, 3)
    rows = even_rows(np.arange(21), 2)
    parts = on_threads(2, lambda ranks: own_rows(ranks, rows, x if ranks.rank == 0 else None))
    assert_array_equal(np.concatenate(parts), x)

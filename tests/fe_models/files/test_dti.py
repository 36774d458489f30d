"""Tables that say which row of a recovery matrix is what."""

import numpy as np
import pytest

from fe_models.errors import MatrixError
from fe_models.files.nastran.bulk_data.cards import read_cards
from fe_models.files.nastran.matrices.dti import EMPTY, SCALAR, element_rows, grid_rows


def cards(table, *entries):
    """Return the cards of record 2 of a table, free format, four fields to an entry."""
    words = [str(word) for entry in entries for word in entry] + ["ENDREC"]
    fields = [table, "2", *[""] * 6, *words]
    lines = [fields[k : k + 8] for k in range(0, len(fields), 8)]
    text = "\n".join(",".join(["DTI" if k == 0 else "", *line]) for k, line in enumerate(lines))
    return list(read_cards("t.pch", text + "\n"))


def test_a_scalar_point_has_one_row_and_empty_ones_behind_it():
    """Points 11 (grid), 7 (scalar, of six rows) and 9 (scalar, of one)."""
    found = grid_rows("t", cards("TUG1", (1, 11, 6, 1), (2, 7, 6, 7), (2, 9, 1, 13)), "TUG1", 13)
    expected = [*((11, k) for k in range(6)), (7, SCALAR), *[(7, EMPTY)] * 5, (9, SCALAR)]
    np.testing.assert_array_equal(found, expected)


def test_items_of_an_element_are_numbered_from_one():
    found = element_rows("t", cards("TEF1", (34, 5, 2, 1), (12, 8, 3, 3)), "TEF1", 5)
    np.testing.assert_array_equal(found, [(34, 5, 1), (34, 5, 2), (12, 8, 1), (12, 8, 2), (12, 8, 3)])


@pytest.mark.parametrize(("entries", "n_rows", "told"), [
    ([(1, 11, 6, 2)], 6, "rows of 11 begin at 2, expected 1"),
    ([(1, 11, 5, 1)], 5, "point 11: expected 6 rows, got 5"),
    ([(2, 11, 7, 1)], 7, "point 11: expected 6 rows, got 7"),
    ([(3, 11, 6, 1)], 6, "point 11: expected type 1 .grid. or 2 .scalar., got 3"),
    ([(2, 11, 1, 1)], 6, "TUG1 has 1 rows, its matrix 6"),
])  # fmt: skip
def test_a_table_that_does_not_fit_its_matrix_is_refused(entries, n_rows, told):
    with pytest.raises(MatrixError, match=told):
        grid_rows("t", cards("TUG1", *entries), "TUG1", n_rows)

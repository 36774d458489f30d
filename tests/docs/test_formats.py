"""The tables of `cms formats`, from which the page of all formats is made."""

from cms.cli.exchange import FORMATS, markdown_tables
from fe_models.files.read_mesh import MESH_FORMATS


def test_the_tables_have_a_row_for_each_way_in_and_out():
    rows = [line for line in markdown_tables().splitlines() if line.startswith("| ")]
    ways = sum(known.reads for known in FORMATS) + sum(known.writes for known in FORMATS)
    assert len(rows) == ways + 4  # two heads of two lines
    assert len({line.count(" | ") for line in rows}) == 1


def test_every_suffix_of_a_mesh_is_listed():
    listed = {suffix for known in FORMATS if known.reads for suffix in known.suffixes}
    assert set(MESH_FORMATS) <= listed


def test_a_format_is_read_or_written_and_names_are_unique():
    assert all(known.reads or known.writes for known in FORMATS)
    keys = [known.key for known in FORMATS if known.key and known.writes]
    assert len(set(keys)) == len(keys)

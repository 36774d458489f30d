"""The table of docs/formats.md is that of `cms formats`."""

from cms.cli.exchange import FORMATS, markdown_tables
from fe_models.files.read_mesh import MESH_FORMATS
from tests.root import ROOT


def test_the_page_has_the_table_of_the_command():
    page = (ROOT / "docs" / "formats.md").read_text()
    table = page.partition("<!-- formats -->\n")[2].partition("<!-- end of formats -->")[0]
    assert table.strip() == markdown_tables(), "write it again: cms formats --markdown"


def test_every_suffix_of_a_mesh_is_listed():
    listed = {suffix for known in FORMATS if known.reads for suffix in known.suffixes}
    assert set(MESH_FORMATS) <= listed


def test_a_format_is_read_or_written_and_names_are_unique():
    assert all(known.reads or known.writes for known in FORMATS)
    keys = [known.key for known in FORMATS if known.key and known.writes]
    assert len(set(keys)) == len(keys)

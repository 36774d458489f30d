"""The page of the fields of decks is written from the tables that drive the readers."""

from fe_models.files.field_pages import field_tables
from tests.root import ROOT

AGAIN = "write it again: fe_models.files.field_pages.field_tables()"


def test_the_page_of_deck_fields_is_that_of_the_tables():
    page = (ROOT / "docs" / "deck_fields.md").read_text(encoding="utf-8")
    table = page.partition("<!-- fields -->\n")[2].partition("<!-- end of fields -->")[0]
    assert table.strip() == field_tables(), AGAIN

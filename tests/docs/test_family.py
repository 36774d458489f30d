"""The page of a body for many lengths: its commands work in their order, and print what it says."""

import sys

import pytest

from tests.docs.tutorials import go_through, run_here


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    before = sys.argv
    try:
        yield go_through("family", tmp_path_factory.mktemp("bar"), run_here)
    finally:
        sys.argv = before


def test_the_commands_print_what_the_page_says(walk):
    assert walk.missing == ()


def test_the_interpolated_body_has_its_length_and_passes(walk):
    assert "(1.13, 0, 0)" in walk.said
    assert "fails" not in walk.said
    assert (walk.folder / "bar_1130.h5").stat().st_size

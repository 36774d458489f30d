"""The groups of tests: every test is in one, nothing skips where everything is required, and budgets are told."""

import itertools
import os
import re
import subprocess
import sys
import textwrap

import pytest

from tests.__main__ import GROUPS, Group, main, run
from tests.floatframe.formulations import EXCEPTIONS, ROOMS, SHORT
from tests.root import ROOT


def test_a_test_of_any_markers_is_in_one_check_of_one_group():
    import tomllib

    options = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["pytest"]["ini_options"]
    markers = [marker.split(":")[0] for marker in options["markers"]]
    checks = [check for group in GROUPS.values() for stage in group.stages for check in stage]
    chosen = [check[check.index("-m") + 1] for check in checks if check[-1] == "tests"]
    assert len(chosen) == 3
    for given in itertools.product((False, True), repeat=len(markers)):
        marked = dict(zip(markers, given, strict=True))
        assert sum(eval(expression, {}, marked) for expression in chosen) == 1, marked


def test_an_unknown_group_is_refused_with_the_choices(capsys):
    assert main(["--slow"]) == 2
    assert "expected one of --ci, --long, --relative, --external, --campaign" in capsys.readouterr().out


def test_the_first_check_that_fails_ends_a_group_with_its_exit_code(capfd, monkeypatch):
    monkeypatch.setitem(sys.modules, "tests.nothing", None)
    assert run(Group(((("bad", "no_such_module"),), (("next", "this"),)), 1.0)) != 0
    printed = capfd.readouterr().out
    assert "== bad failed with exit code" in printed
    assert "== next" not in printed


def test_checks_side_by_side_all_report_and_one_that_fails_ends_the_group(capfd):
    stage = (("good", "this"), ("bad", "no_such_module"), ("other", "this"))
    assert run(Group((stage, (("next", "this"),)), 1.0)) != 0
    printed = capfd.readouterr().out
    assert printed.count("Beautiful is better than ugly") == 2
    assert "No module named no_such_module" in printed
    assert "== bad failed with exit code" in printed
    assert printed.count("failed") == 1
    assert "== next" not in printed


FILES = {
    "plain": """
        import pytest
        def test_it(): pytest.skip("no such thing here")
    """,
    "module": """
        import pytest
        pytest.importorskip("no_such_library")
        def test_it(): pass
    """,
    "external": """
        import pytest
        @pytest.mark.external
        def test_it(): pytest.skip("no such program here")
    """,
}


@pytest.mark.parametrize(("name", "counts"), [("plain", "1 failed"), ("module", "1 error"), ("external", "1 skipped")])
def test_nothing_skips_where_everything_is_required(tmp_path, name, counts):
    (tmp_path / "conftest.py").write_text((ROOT / "tests" / "conftest.py").read_text())
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers =\n    external: other programs\n")
    (tmp_path / f"test_{name}.py").write_text(textwrap.dedent(FILES[name]))
    for required, expected in (("1", counts), ("0", "1 skipped")):
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "."], cwd=tmp_path, capture_output=True,
            text=True, env=os.environ | {"FLOATFRAME_REQUIRE_ALL": required}, check=False,
        )  # fmt: skip
        assert re.search(expected, done.stdout.splitlines()[-1]), done.stdout


def test_exceptions_of_the_relative_formulation_name_tests_that_exist():
    """That each of them fails there is seen where they run: they are expected to, strictly."""
    folder = ROOT / "tests" / "floatframe"
    for name, reason in EXCEPTIONS.items():
        file, _, test = name.partition("::")
        assert file.split("/")[0] in ROOMS
        assert f"def {test.partition('[')[0]}(" in (folder / file).read_text(), name
        assert len(reason) > 20
    for file in SHORT:
        assert (ROOT / file).is_file()
        assert file.split("/")[2] in ROOMS


def test_a_run_in_relative_coordinates_keeps_the_tests_of_the_engine_alone():
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--formulation", "relative", "--collect-only",
         "tests/test_errors.py", "tests/floatframe/forces/test_joint_forces.py"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "test_errors.py::" not in done.stdout
    assert "test_joint_forces.py::" in done.stdout
    assert "deselected" in done.stdout

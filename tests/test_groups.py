"""The groups of tests: every test is in one, nothing skips where everything is required, and budgets are told."""

import itertools
import os
import re
import subprocess
import sys
import textwrap

import pytest

from tests.__main__ import GROUPS, TESTS, Group, environment, main, run
from tests.floatframe.formulations import EXCEPTIONS, ROOMS, SHORT
from tests.import_graph import modules, named_modules, used_modules
from tests.mutants import guarding_files
from tests.root import ROOT
from tests.slowest import SLOWEST


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


def test_an_unknown_campaign_is_refused_with_the_choices(capsys):
    assert main(["--campaign", "nosuch"]) == 2
    told = capsys.readouterr().out
    assert "expected families among jobs, meshes, systems, " in told
    assert "got 'nosuch'" in told


def test_guards_of_a_module_are_the_tests_that_import_it_nearest_first(capsys):
    """A module of one room, whose tests import it themselves, and which no test of another package reaches."""
    assert main(["--guards", "floatframe/components/hydraulics/circuit_data.py"]) == 0
    first, *lines = capsys.readouterr().out.splitlines()
    found = {line.split()[1]: int(line.split()[0]) for line in lines}
    assert first == f"floatframe/components/hydraulics/circuit_data.py: {len(found)} test files, by the imports between"
    room = "tests/floatframe/components/hydraulics/test_"
    assert {f"{room}circuit.py", f"{room}jack.py", "tests/floatframe/laws/test_every_constant.py"} <= set(found)
    assert min(found.values()) == found[f"{room}circuit.py"]
    assert list(found.values()) == sorted(found.values())
    assert not [name for name in found if name.startswith(("tests/fe_models/", "tests/cms/"))]


def test_tests_of_the_room_judge_mutants_first():
    """Here beside the other test that reads the imports of all tests, so that they are read once."""
    found = guarding_files(ROOT / "floatframe/components/hydraulics/circuit_data.py", 4)
    assert len(found) == 4
    assert found[0] == "tests/floatframe/components/hydraulics/test_circuit.py"


def test_guards_of_what_is_no_module_are_refused_with_what_is_near(capsys):
    assert main(["--guards", "cms/linear_algebra/solvers/eigne.py"]) == 2
    assert "no such module; near: cms.linear_algebra.solvers.eigen" in capsys.readouterr().out


def test_public_names_strings_and_packages_as_a_whole_count_as_imports(tmp_path):
    """Each way to a module: an import, a name of a package that imports late, its name in a string, `getattr`."""
    (path := tmp_path / "test_it.py").write_text(
        """
        import cms as c, floatframe.model.joints.lower_pairs
        from cms import write
        from tests import bodies
        body = c.reduce(1)
        LATE = "cms.assessment.report.page:main"
        """.replace("        ", "")
    )
    found = used_modules(path)
    assert {"cms.reduction.reduction", "cms.body.modal_file.file", "tests.bodies"} <= found
    assert "floatframe.model.joints.lower_pairs" in found
    assert "cms.assessment.report.page" in found or "cms.assessment.report" in found
    assert "cms.modes.mode_sets.krylov" not in found
    path.write_text("import cms\nnames = [getattr(cms, name) for name in cms.__all__]\n")
    assert {"cms.reduction.reduction", "cms.body.modal_file.file"} <= used_modules(path)


def test_data_pages_and_what_every_test_rests_on_stand_for_their_tests():
    assert named_modules(["cms/assessment/report/data/page.css"]) == {
        name
        for name in modules()
        if name.rpartition(".")[0] == "cms.assessment.report" or name == "cms.assessment.report"
    } - {name for name, path in modules().items() if path.parent.parent.name == "report"}
    assert {name.split(".")[1] for name in named_modules(["docs/theory.md"])} == {"docs"}
    assert len(named_modules(["pyproject.toml"])) > 400
    assert named_modules(["tests/test_groups.py"]) == {"tests.test_groups"}


def test_a_base_that_does_not_exist_is_refused(capsys):
    assert main(["--changed", "no-such-branch"]) == 2
    assert "expected a branch or commit to compare with, got 'no-such-branch'" in capsys.readouterr().out


def test_the_tests_that_guard_a_change_run(capfd, monkeypatch):
    monkeypatch.setattr("tests.import_graph.changed_files", lambda: ["README", "fe_models/body/material.py"])
    monkeypatch.setattr(
        "tests.import_graph.guards", lambda names: {"this": 0} if names == {"fe_models.body.material"} else {}
    )
    monkeypatch.setattr("tests.__main__.run", lambda group: print(group.stages[1][0][-1]) or 0)
    assert main(["--changed"]) == 0
    assert capfd.readouterr().out.splitlines()[:2] == ["2 files changed since main, 1 test files guard them", "this"]


def test_the_first_check_that_fails_ends_a_group_with_its_exit_code(capfd, monkeypatch):
    monkeypatch.setitem(sys.modules, "tests.nothing", None)
    assert run(Group(((("bad", "no_such_module"),), (("next", "this"),)), 1.0)) != 0
    printed = capfd.readouterr().out
    assert "== bad failed with exit code" in printed
    assert "== next" not in printed


def test_the_slowest_files_and_the_notebooks_start_first():
    """Names alone, in a run of the plugin over files that are found in the order of the alphabet."""
    quick, slow = "tests/test_errors.py", "tests/pipeline/test_line.py"
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "tests.slowest", "--collect-only",
         quick, "tests/notebooks/test_kart.py", slow], cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    files = list(dict.fromkeys(line.partition("::")[0] for line in done.stdout.splitlines() if "::" in line))
    assert files == [slow, "tests/notebooks/test_kart.py", quick], done.stdout


def test_processes_of_a_check_store_the_byte_code_of_modules(monkeypatch):
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    assert "PYTHONDONTWRITEBYTECODE" not in environment(TESTS)


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


@pytest.mark.parametrize(("required", "verdicts"), [
    ("1", {"ERROR test_module.py", "FAILED test_plain.py", "SKIPPED test_external.py"}),
    ("0", {"SKIPPED test_module.py", "SKIPPED test_plain.py", "SKIPPED test_external.py"}),
])  # fmt: skip
def test_nothing_skips_where_everything_is_required(tmp_path, required, verdicts):
    (tmp_path / "conftest.py").write_text((ROOT / "tests" / "conftest.py").read_text())
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers =\n    external: other programs\n")
    for name, content in FILES.items():
        (tmp_path / f"test_{name}.py").write_text(textwrap.dedent(content))
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-ra", "-p", "no:cacheprovider", "--continue-on-collection-errors", "."],
        cwd=tmp_path, capture_output=True, text=True, check=False,
        env=os.environ | {"FLOATFRAME_REQUIRE_ALL": required},
    )  # fmt: skip
    found = re.findall(r"^(ERROR|FAILED|SKIPPED) (?:\[1\] )?(test_\w+\.py)", done.stdout, re.MULTILINE)
    assert {" ".join(each) for each in found} == verdicts, done.stdout


def test_exceptions_of_the_relative_formulation_name_tests_that_exist():
    """That each of them fails there is seen where they run: they are expected to, strictly."""
    folder = ROOT / "tests" / "floatframe"
    for name, reason in EXCEPTIONS.items():
        file, _, test = name.partition("::")
        assert file.startswith(ROOMS)
        assert f"def {test.partition('[')[0]}(" in (folder / file).read_text(), name
        assert len(reason) > 20
    for file in (*SHORT, *SLOWEST):
        assert (ROOT / file).is_file()
    for file in SHORT:
        assert file.removeprefix("tests/floatframe/").startswith(ROOMS)


def test_a_run_in_relative_coordinates_keeps_the_tests_of_the_engine_alone():
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--formulation", "relative", "--collect-only",
         "tests/test_errors.py", "tests/floatframe/model/forces/test_joint_forces.py"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "test_errors.py::" not in done.stdout
    assert "test_joint_forces.py::" in done.stdout
    assert "deselected" in done.stdout

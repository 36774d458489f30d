"""How much of the packages a reader passes from a mesh to a modal file; the bounds are what was reached."""

import subprocess
import sys

import pytest

from tests.cms.path_of_a_job import functions_called
from tests.root import ROOT

MOST_FUNCTIONS = 450  # one of them, the finaliser of the factor, runs when Python collects it
MOST_FILES = 80


def test_functions_called_counts_each_function_of_the_packages_once():
    from fe_models.foundation.units import UNIT_SYSTEMS

    units = UNIT_SYSTEMS["mm-t-s"]
    (line,) = functions_called(lambda: [units.to_si(length=1) for _ in range(2)])
    assert line.startswith("fe_models/foundation/units.py:")
    assert line.endswith(" Units.to_si")


@pytest.fixture(scope="module")
def path() -> list[str]:
    """The functions that the rod of `cms demo` passes, in a process that has not called any of them."""
    command = [sys.executable, "-m", "tests.cms.path_of_a_job"]
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.splitlines()


def test_the_rod_of_the_demo_passes_few_functions(path):
    assert len(path) <= MOST_FUNCTIONS, "\n".join(path)


def test_the_rod_of_the_demo_passes_few_files(path):
    files = {line.partition(":")[0] for line in path}
    assert len(files) <= MOST_FILES, "\n".join(sorted(files))


def test_the_path_goes_from_the_job_to_the_modal_file(path):
    """The bounds would hold of a path that was not recorded."""
    names = [line.partition(" ")[2] for line in path]
    steps = ["read_job", "read_mesh", "solid_body", "couple", "craig_bampton_ir", "reduce", "write"]
    places = [names.index(step) for step in steps]
    assert places == sorted(places)

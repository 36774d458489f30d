import math
import sys

import pytest

from fe_models.errors import FeModelsError
from fe_models.foundation.extras import MissingExtraError, extra_module


def test_a_library_that_is_there_is_imported():
    assert extra_module("math", extra="mesh", purpose="sums") is math


def test_a_missing_library_is_named_with_the_line_that_installs_it():
    with pytest.raises(FeModelsError, match=r"STEP files: needs no_such_library, which is not installed; .*\[mesh\]"):
        extra_module("no_such_library.inner", extra="mesh", purpose="STEP files")


def test_a_library_that_lacks_its_own_parts_is_told_apart(tmp_path, monkeypatch):
    (tmp_path / "half_installed.py").write_text("import no_such_part\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(MissingExtraError, match=r"half_installed, which does not load \(No module named"):
        extra_module("half_installed", extra="mesh", purpose="STEP files")
    sys.modules.pop("half_installed", None)

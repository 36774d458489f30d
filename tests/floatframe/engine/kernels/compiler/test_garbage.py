"""Python looks for garbage again after a compilation, also after one that fails, and only if it did before."""

import gc

import pytest

from floatframe.engine.kernels.compiler.garbage import without_garbage_collection


def test_the_search_for_garbage_goes_on_as_before():
    with pytest.raises(ValueError, match="no such law"), without_garbage_collection():
        raise ValueError("no such law")
    assert gc.isenabled()
    gc.disable()
    try:
        with without_garbage_collection():
            assert not gc.isenabled()
        assert not gc.isenabled()
    finally:
        gc.enable()

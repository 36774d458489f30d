"""Where the machine code of laws of elements is kept."""

from types import FunctionType

from numba import njit
from numba.core.caching import FunctionCache

from floatframe.engine.compiling.callbacks.law_functions import filled
from floatframe.engine.compiling.callbacks.law_source import digest_of
from floatframe.engine.compiling.callbacks.law_templates import given_template, value_template


def stiff(t, x, z, lam, data, wrench, z_dot, g, outputs):
    wrench[0, 0] = 2.0 * data[0]


def soft(t, x, z, lam, data, wrench, z_dot, g, outputs):
    wrench[0, 0] = 1.0 * data[0]


def index_of(template, function):
    law = njit(function)
    return FunctionCache(filled(template, law, digest_of(law)))._impl.filename_base


def test_each_law_has_an_index_of_its_own_in_the_cache():
    """In one index, two processes that add a law each at the same moment give both the same file."""
    assert index_of(value_template, stiff) == index_of(value_template, stiff)
    assert len({index_of(template, law) for template in (value_template, given_template) for law in (stiff, soft)}) == 4


def test_a_law_that_moved_to_another_module_is_compiled_anew():
    """Its code in the cache asks for the module where it stood, which is gone."""
    here, there = (FunctionType(stiff.__code__, {"__name__": name}) for name in ("here", "there"))
    assert digest_of(njit(here)) != digest_of(njit(there))
    assert digest_of(njit(here)) == digest_of(njit(FunctionType(stiff.__code__, {"__name__": "here"})))


@njit
def falling(n, x):
    return x if n == 0 else falling(n - 1, 0.5 * x)


@njit
def calls_itself(t, x, z, lam, data, wrench, z_dot, g, outputs):
    wrench[0, 0] = falling(3, x[0, 0])


def test_a_law_that_calls_itself_is_not_stored():
    """In another process, numba leaves its call of itself without an address."""
    assert digest_of(calls_itself) is None

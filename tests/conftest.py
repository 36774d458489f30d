"""Where everything is required, a test that skips has failed; only tests of other programs may skip, visibly.

FLOATFRAME_REQUIRE_ALL=1 (set by .ci/run) says that everything is required.
"""

import gc
import os
import signal

import pytest

if "PYTEST_XDIST_WORKER" in os.environ:
    for name in ("COLUMNS", "LINES"):  # a worker has those of a terminal, and tables would be cut to its width
        os.environ.pop(name, None)


def pytest_addoption(parser):
    parser.addoption(
        "--formulation", choices=("absolute", "relative"), default="absolute",
        help="formulation of what a test gives none; relative: tests of the engine alone",
    )  # fmt: skip


def pytest_configure(config):
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # as a shell leaves it to what it starts in the background
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if config.getoption("formulation") == "relative":
        from tests.floatframe.formulations import take_relative

        take_relative()


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Collect the tests without collecting garbage, and leave the tests out of every later collection.

    They are 700 000 objects that all live to the end, and each full collection would visit them.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


LONG = 12000  #: seconds after which a study hangs


def pytest_collection_modifyitems(config, items):
    for item in items:
        if item.get_closest_marker("long") is not None:
            item.add_marker(pytest.mark.timeout(LONG))
    if config.getoption("formulation") == "relative":
        from tests.floatframe.formulations import select

        select(config, items)


REQUIRES_ALL = os.environ.get("FLOATFRAME_REQUIRE_ALL") == "1"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    report = yield
    if (
        REQUIRES_ALL
        and report.skipped
        and not hasattr(report, "wasxfail")
        and item.get_closest_marker("external") is None
    ):
        fail(report)
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    report = yield
    if REQUIRES_ALL and report.skipped and "external" not in collector.path.parts:
        fail(report)
    return report


def fail(report):
    reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr
    report.outcome, report.longrepr = "failed", f"{reason}: nothing may skip here (FLOATFRAME_REQUIRE_ALL=1)"


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node, error):
    """Say how a worker ended that disappeared: its own last words are lost with the output that it captured."""
    if error:
        process = node.gateway._io.popen
        process.wait(timeout=30)
        code = process.returncode
        how = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        print(f"\n{node.gateway.id} ended with {how}", flush=True)

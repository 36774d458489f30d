"""Which functions of the packages a reduction calls: `python -m tests.cms.path_of_a_job` lists them for the demo's rod.

A function counts once, methods and nested functions too; lambdas and comprehensions belong to the function around them.
What runs while a module is imported, and in other threads than the first, does not count, nor do error estimates, nor
the search for stored code of kernels, which depends on what is stored.
"""

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

from tests.root import ROOT

OURS = tuple(f"{ROOT / package}/" for package in ("fe_models", "cms", "floatframe"))
STORED_CODE = f"{ROOT / 'fe_models' / 'foundation' / 'kernels'}/"


def functions_called(run: Callable[[], Any]) -> list[str]:
    """Return the functions that a run calls, as "file:line name", in the order of their first calls."""
    seen: dict[CodeType, bool] = {}  # whether the function counts

    def watch(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event == "call" and not seen.get(code):
            last = code.co_qualname.rpartition(".")[2]
            is_ours = code.co_filename.startswith(OURS) and not code.co_filename.startswith(STORED_CODE)
            seen[code] = is_ours and not last.startswith("<") and not is_import(frame)

    sys.setprofile(watch)
    try:
        run()
    finally:
        sys.setprofile(None)
    called = [code for code, counts in seen.items() if counts]
    return [f"{Path(c.co_filename).relative_to(ROOT)}:{c.co_firstlineno} {c.co_qualname}" for c in called]


def is_import(frame: FrameType | None) -> bool:
    """Whether a frame runs because a module is being imported."""
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            return True
        frame = frame.f_back
    return False


def main() -> None:
    import cms
    from cms.cli.demo import put_inputs
    from cms.jobs.job import read_job

    with tempfile.TemporaryDirectory() as folder:
        put_inputs(Path(folder))

        def run() -> None:
            job = read_job(Path(folder) / "rod.toml")
            plain = job.reduction.model_copy(update={"error_estimates": False})
            cms.write(cms.reduce_job(job.model_copy(update={"reduction": plain})), Path(folder) / "rod.h5")

        print("\n".join(functions_called(run)))


if __name__ == "__main__":
    main()

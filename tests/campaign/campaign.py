"""The campaign runs every case in a worker process with a limit of time, and counts what became of it.

    python -m tests --campaign                     1400 bad inputs, 100 kills, 300 motions, 300 bodies,
                                                   200 verdicts, 300 decks of each program beside an assembler
    python -m tests --campaign motions jobs        two families
    python -m tests --campaign jobs 147            one case, its verdict in words
    python -m tests --campaign motions --count 1000 --seed 5      so many cases of each, seeds from 5 on

Motions, bodies, verdicts and decks beside an assembler have new seeds in each run, the other families those from 0 on;
--seed gives the first. A fault prints its family and seed, which repeat it. A hang is a case that takes more than
`LIMIT` seconds of processor time, or that is silent for `SILENCE` seconds; a worker that ends otherwise is a traceback
of its case. The exit code is 0 if there is no traceback, no hang, no wrong acceptance
and no unclear message.
"""

import argparse
import importlib
import secrets
import shutil
import signal
import tempfile
import time
from collections import Counter
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from tests.campaign.files import prepared
from tests.campaign.verdict import ACCEPTED, HANG, REFUSED, TRACEBACK, UNCLEAR, WRONG, Verdict

__all__ = ["FAMILIES", "main"]

FAMILIES: dict[str, tuple[str, int]] = {  # what it is -> the function of a case, how many
    "jobs": ("tests.campaign.jobs:job_case", 240),
    "meshes": ("tests.campaign.jobs:mesh_case", 180),
    "systems": ("tests.campaign.systems:system_case", 200),
    "bytes": ("tests.campaign.files:bytes_case", 90),
    "heads": ("tests.campaign.files:head_case", 90),
    "expressions": ("tests.campaign.expressions:expression_case", 100),
    "commands": ("tests.campaign.commands:command_case", 100),
    "decks": ("tests.campaign.imports:deck_case", 150),
    "matrices": ("tests.campaign.imports:matrix_case", 150),
    "reduced-bodies": ("tests.campaign.imports:body_case", 100),
    "kills": ("tests.campaign.kills:kill_case", 100),
    "motions": ("tests.campaign.motions:motion_case", 300),
    "bodies": ("tests.campaign.bodies:body_case", 300),
    "verdicts": ("tests.campaign.verdicts:verdict_case", 200),
    "deck-bodies": ("tests.campaign.deck_bodies:body_case", 300),
    "abaqus-bodies": ("tests.campaign.abaqus_bodies:body_case", 300),
    "ansys-bodies": ("tests.campaign.ansys_bodies:body_case", 300),
}
NEW_SEEDS = (
    "motions",
    "bodies",
    "verdicts",
    "deck-bodies",
    "abaqus-bodies",
    "ansys-bodies",
)  #: families whose seeds are new in each run
LIMIT = 60.0  #: processor time of a case [s]; a loaded machine does not change it
FIRST = 600.0  #: of the first one in a worker, which may compile the kernels [s]
SILENCE = 3600.0  #: time after which a case that computes nothing is given up [s]
PROCESSES = 2
SORTS = (
    "compared",
    "right",
    "noted",
    "noted though right",
    "chaotic",
    "no reference",
    "undetermined",
)  #: first words of what was accepted, counted


def case_of(family: str) -> Any:
    """Return the function of a family."""
    module, name = FAMILIES[family][0].split(":")
    return getattr(importlib.import_module(module), name)


def limit_processor_time(seconds: float) -> None:
    """End this process when it has used so many more seconds of processor time; 0 sets no limit."""
    signal.setitimer(signal.ITIMER_PROF, seconds)  # SIGPROF ends a process, also within compiled code


def verdict_of_exit(code: int | None) -> Verdict:
    """Return the verdict of a case whose process ended."""
    if code == -signal.SIGPROF:
        return Verdict(HANG, "no answer within the limit of processor time")
    return Verdict(TRACEBACK, f"the process ended with exit code {code}")


def serve(pipe: Connection, home: str) -> None:
    """Run the cases that are asked for; the main function of a worker."""
    prepared(Path(home) / "prepared")  # compiles what is compiled at first use
    number = 0
    while True:
        family, seed = pipe.recv()
        number += 1
        folder = Path(home) / f"case{number}"
        folder.mkdir()
        limit_processor_time(FIRST if number == 1 else LIMIT)
        try:
            verdict = case_of(family)(seed, folder)
        except BaseException as error:  # of the oracle too: it must understand what was accepted
            verdict = Verdict(TRACEBACK, f"{type(error).__name__}: {error}"[:600])
        limit_processor_time(0.0)
        shutil.rmtree(folder, ignore_errors=True)
        pipe.send(verdict)


class Worker:
    """A process that runs cases, and the one it is at."""

    def __init__(self, home: Path) -> None:
        self.home = Path(tempfile.mkdtemp(dir=home))
        self.pipe, other = get_context("spawn").Pipe()
        self.process = get_context("spawn").Process(target=serve, args=(other, str(self.home)), daemon=False)
        self.process.start()
        other.close()
        self.case: tuple[str, int] | None = None
        self.deadline = 0.0

    def give(self, case: tuple[str, int]) -> None:
        """Give it a case."""
        self.case, self.deadline = case, time.monotonic() + SILENCE
        self.pipe.send(case)

    def end(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.join()
        self.pipe.close()
        shutil.rmtree(self.home, ignore_errors=True)


def main(words: list[str] | None = None) -> int:
    """Run the campaign, or the one case that is named; print what was found and the counts in the last line."""
    request = request_of(list(words or ()))
    if isinstance(request, str):
        print(f"python -m tests --campaign: {request}")
        return 2
    chosen, count, first = request.families or list(FAMILIES), request.count, request.seed
    if request.case is not None:
        family = chosen[0]
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "case").mkdir()
            verdict = case_of(family)(request.case, Path(folder) / "case")
        print(f"{family} {request.case}: {verdict.kind}: {verdict.words}")
        return int(verdict.kind not in (REFUSED, ACCEPTED))
    cases = []
    for family in chosen:
        begin = first if first is not None else secrets.randbelow(10**9) if family in NEW_SEEDS else 0
        cases += [(family, begin + k) for k in range(count or FAMILIES[family][1])]
        if family in NEW_SEEDS:
            print(f"{family}: seeds from {begin} on", flush=True)
    begun = time.monotonic()
    counts: dict[str, Counter[str]] = {family: Counter() for family in chosen}
    with tempfile.TemporaryDirectory(prefix="campaign-") as home:
        for case, verdict in verdicts(cases, Path(home)):
            counts[case[0]][verdict.kind] += 1
            kind = verdict.words.partition(":")[0]
            if verdict.kind == ACCEPTED and kind in SORTS:
                counts[case[0]][kind] += 1
            if verdict.kind not in (REFUSED, ACCEPTED):
                print(f"{case[0]} {case[1]}: {verdict.kind}: {' '.join(verdict.words.split())[:500]}", flush=True)
    for family, found in counts.items():
        told = ", ".join(f"{kind} {found[kind]}" for kind in (REFUSED, ACCEPTED, TRACEBACK, HANG, WRONG, UNCLEAR))
        sorts = ", ".join(f"{kind} {found[kind]}" for kind in SORTS if found[kind])
        print(f"{family}: {told}" + (f" (of those accepted {sorts})" if sorts else ""))
    total: Counter[str] = sum(counts.values(), Counter())
    counted = {name: sum(family == name for family, _ in cases) for name in ("kills", *NEW_SEEDS)}
    print(
        f"campaign: {len(cases) - sum(counted.values())} bad inputs, "
        f"{', '.join(f'{n} {name}' for name, n in counted.items())} in "
        f"{time.monotonic() - begun:.0f} s: {total[TRACEBACK]} tracebacks, {total[HANG]} hangs, {total[WRONG]} wrong "
        f"acceptances, {total[UNCLEAR]} unclear messages"
    )
    return int(any(total[kind] for kind in (TRACEBACK, HANG, WRONG, UNCLEAR)))


def request_of(words: list[str]) -> argparse.Namespace | str:
    """Return families, case, count and seed of the words of the command line; what is wrong with them, in words."""
    parser = argparse.ArgumentParser(prog="python -m tests --campaign", add_help=False, exit_on_error=False)
    parser.add_argument("families", nargs="*")
    parser.add_argument("--count", type=int)
    parser.add_argument("--seed", type=int)
    try:
        request, unknown = parser.parse_known_args(words)
    except argparse.ArgumentError as error:
        return str(error)
    request.case = None
    if len(request.families) == 2 and request.families[1].isdigit():
        request.case = int(request.families.pop())
    for word in [*unknown, *(name for name in request.families if name not in FAMILIES)]:
        return f"expected families among {', '.join(FAMILIES)}, --count or --seed; got {word!r}"
    for name in ("count", "seed"):
        value = getattr(request, name)
        if value is not None and value < (1 if name == "count" else 0):
            return f"--{name}: expected a number of at least {1 if name == 'count' else 0}, got {value}"
    return request


def verdicts(cases: list[tuple[str, int]], home: Path) -> Any:
    """Yield (case, verdict) as they come; a worker that hangs or ends is replaced."""
    waiting, workers = list(reversed(cases)), [Worker(home) for _ in range(PROCESSES)]
    try:
        while waiting or any(worker.case for worker in workers):
            for worker in workers:
                if worker.case is None and waiting:
                    worker.give(waiting.pop())
            ready = wait([worker.pipe for worker in workers if worker.case], timeout=1.0)
            for k, worker in enumerate(workers):
                case = worker.case
                if case is None:
                    continue
                if worker.pipe in ready:
                    try:
                        verdict = worker.pipe.recv()
                        worker.case = None
                    except (EOFError, OSError):
                        worker.process.join(5)
                        verdict = verdict_of_exit(worker.process.exitcode)
                elif time.monotonic() > worker.deadline:
                    verdict = Verdict(HANG, f"no answer within {SILENCE:g} s")
                else:
                    continue
                if worker.case is not None:
                    worker.end()
                    workers[k] = Worker(home)
                yield case, verdict
    finally:
        for worker in workers:
            worker.end()

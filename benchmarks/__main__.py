"""Measure everything that is short, and say what became worse.

    python -m benchmarks                  # about 15 minutes on a quiet machine with two cores
    python -m benchmarks recursive eigen  # some of them
    python -m benchmarks --list           # their names
    python -m benchmarks --keep           # also writes results.json, docs/figures.md and the figures that texts quote
    python -m benchmarks --quote          # only renews quoted figures from benchmarks/results.json

Each benchmark runs in a process of its own, one after the other. Ratios that became worse than in the kept results by
more than 15 % are measured a second time; those that stay so are named, and the exit status is 1. Without --keep the
results go to benchmarks/out. A benchmark that cannot be measured here (a peer that is not installed) is named and keeps
its last figures.
"""

import argparse
import os
import sys
import time
from dataclasses import replace
from datetime import UTC, datetime

from benchmarks import watch
from benchmarks.watch import Results

LIMIT = 400.0  #: seconds for one of them


def arguments() -> argparse.Namespace:
    """Return what was asked for."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", help="benchmarks to measure; all that are short if none is named")
    parser.add_argument("--list", action="store_true", help="print the names and end")
    parser.add_argument("--keep", action="store_true", help="write results, page and quoted figures")
    parser.add_argument("--quote", action="store_true", help="renew quoted figures from the kept results and end")
    parser.add_argument("--long", action="store_true", help="the sizes of the tables in benchmarks/README.md, hours")
    asked = parser.parse_args()
    known = watch.modules()
    if unknown := [name for name in asked.names if name not in known]:
        parser.error(f"no benchmark {', '.join(unknown)}; known: {', '.join(known)}")
    return asked


def run(names: list[str], last: Results | None, *, short: bool) -> Results:
    """Measure benchmarks one after the other, and again where one seems to have become worse."""
    now = Results(
        commit=watch.commit(),
        date=datetime.now(UTC).strftime("%Y-%m-%d"),
        machine=watch.this_machine(),
        load=os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan"),
        figures={},
        seconds={},
    )
    for k, name in enumerate(names, 1):
        print(f"[{k}/{len(names)}] {name}", end=" ", flush=True)
        begin = time.perf_counter()
        try:
            figures = watch.measured(name, short=short, limit=LIMIT if short else 1e5)
            alone = replace(now, figures={name: figures})
            if any(each.is_regression for each in watch.changes(alone, last)):
                print("again", end=" ", flush=True)
                again = watch.measured(name, short=short, limit=LIMIT if short else 1e5)
                figures = {key: better(key, figures[key], again.get(key, figures[key])) for key in figures}
        except RuntimeError as error:
            now.failed[name] = str(error)
            print(f"not measured: {error}", flush=True)
            if last and name in last.figures:
                now.figures[name], now.seconds[name] = last.figures[name], last.seconds[name]
            continue
        now.figures[name], now.seconds[name] = figures, time.perf_counter() - begin
        print(f"{now.seconds[name]:.0f} s", flush=True)
    return now


def better(name: str, a: float, b: float) -> float:
    """Return the better of two measurements of a figure."""
    return max(a, b) if name.endswith(watch.MORE_IS_BETTER) else min(a, b)


def main() -> int:
    """Measure, print, write; returns the exit status."""
    asked = arguments()
    if asked.list:
        for name in watch.modules():
            print(f"{name:28s} {watch.title(name)}")
        return 0
    last = Results.read(watch.RESULTS)
    if asked.quote:
        if last is None:
            sys.exit(f"{watch.RESULTS}: there are no kept results; measure first: python -m benchmarks --keep")
        for path in watch.quote(last):
            print(path)
        return 0
    now = run(asked.names or watch.modules(), last, short=not asked.long)
    told = watch.changes(now, last)
    module = ""
    for each in told:
        if each.module != module:
            module = each.module
            print(f"\n{module}: {watch.title(module)}")
        print(f"  {each.name:72s} {watch.shown(each.now):>9s}  last {watch.shown(each.last):>9s}  {each.words}")
    if asked.names and last:  # the others stay as they were
        figures = last.figures | {name: last.figures.get(name, {}) | own for name, own in now.figures.items()}
        now = replace(now, figures=figures, seconds=last.seconds | now.seconds, renewed=list(now.figures))
    if asked.keep:
        now.write(watch.RESULTS)
        watch.PAGE.write_text(watch.page(now, last))
        watch.quote(now)
    else:
        out = watch.FOLDER / "out" / "results.json"
        out.parent.mkdir(exist_ok=True)
        now.write(out)
        out.with_suffix(".md").write_text(watch.page(now, last))
        print(f"\n{out.with_suffix('.md')}: the page; --keep writes it to {watch.PAGE}")
    regressions = [each for each in told if each.is_regression]
    for each in regressions:
        print(f"regression: {each.module}: {each.name}: {watch.shown(each.now)} after {watch.shown(each.last)}")
    for name, said in now.failed.items():
        print(f"not measured: {name}: {said}")
    return 1 if regressions else 0


if __name__ == "__main__":
    sys.exit(main())

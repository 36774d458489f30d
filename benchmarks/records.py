"""Records of measurements that are processes of their own, so that peaks of memory do not mix."""

import json
import subprocess
import sys

__all__ = ["print_record", "record_in", "record_of"]

BEGIN = "RECORD "  #: begins the line with the record of a process


def print_record(record):
    """Print a record of numbers and words, the last that a process says."""
    print(BEGIN + json.dumps(record), flush=True)


def record_in(output):
    """Return the record in the output of a process."""
    return json.loads(output[output.index(BEGIN) + len(BEGIN) :].splitlines()[0])


def record_of(module, *words, **options):
    """Return the record of `python -m benchmarks.MODULE WORDS`; options of `subprocess.run`."""
    command = [sys.executable, "-m", f"benchmarks.{module}", *map(str, words)]
    return record_in(subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, **options).stdout)

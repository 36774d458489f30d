"""What became of a bad input, and how a command is asked in this process."""

import warnings
from dataclasses import dataclass
from pathlib import Path

from typer.testing import CliRunner

__all__ = ["ACCEPTED", "HANG", "REFUSED", "TRACEBACK", "UNCLEAR", "WRONG", "Reply", "Verdict", "ask", "judged"]

REFUSED, ACCEPTED, TRACEBACK, HANG, WRONG, UNCLEAR = (
    "refused", "accepted", "traceback", "hang", "wrong acceptance", "unclear message",
)  # fmt: skip
LONGEST_MESSAGE = 4000  #: characters of a refusal, all its problems together


@dataclass(frozen=True)
class Verdict:
    """What became of one input, and why in words."""

    kind: str
    words: str = ""


@dataclass(frozen=True)
class Reply:
    """What a command answered."""

    code: int
    stdout: str
    stderr: str
    fault: str  #: an error that left the command line
    warnings: tuple[str, ...]


def ask(program: str, *words: object) -> Reply:
    """Run a command of `cms` or `floatframe` in this process."""
    from cms.cli.app import app as cms_app
    from floatframe.cli.app import app as floatframe_app

    app = {"cms": cms_app, "floatframe": floatframe_app}[program]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = CliRunner().invoke(app, [str(word) for word in words])
    fault = "" if result.exception is None or isinstance(result.exception, SystemExit) else repr(result.exception)
    return Reply(result.exit_code, result.stdout, result.stderr, fault, tuple(str(each.message) for each in caught))


def judged(reply: Reply, *, folder: Path | None = None) -> Verdict:
    """Return what a reply is, before the oracle looks at what was accepted."""
    text = reply.stdout + reply.stderr
    if reply.fault or reply.code not in (0, 2) or "Traceback" in text or "fault of the program" in text:
        return Verdict(TRACEBACK, f"exit code {reply.code}: {reply.fault} {reply.stderr[-600:]}")
    if reply.code == 0:
        return Verdict(ACCEPTED)
    told = sum(line.startswith("error: ") for line in reply.stderr.splitlines()) + ("Usage:" in reply.stderr)
    if told != 1:
        return Verdict(UNCLEAR, f"{told} messages: {reply.stderr[:600]}")
    if len(reply.stderr) > LONGEST_MESSAGE:
        return Verdict(UNCLEAR, f"{len(reply.stderr)} characters: {reply.stderr[:600]}")
    if reply.warnings:
        return Verdict(UNCLEAR, f"warnings beside a refusal: {reply.warnings[:3]}")
    left = (
        []
        if folder is None
        else [path.name for path in folder.iterdir() if path.name.endswith((".part", ".unfinished"))]
    )
    if left:
        return Verdict(UNCLEAR, f"left behind: {left}")
    return Verdict(REFUSED, reply.stderr[:300])

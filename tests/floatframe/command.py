"""Commands of `floatframe`, as a user calls them."""

from click.testing import Result
from typer.testing import CliRunner

from floatframe.cli.app import app

__all__ = ["answer_of_floatframe", "run_floatframe"]


def run_floatframe(*words: object, code: int | None = None, **options: object) -> Result:
    """Run `floatframe` with these words in this process, and expect an exit code if it is given.

    Options are those of `CliRunner.invoke`.
    """
    result = CliRunner().invoke(app, [str(word) for word in words], **options)
    assert code is None or result.exit_code == code, result.output
    return result


def answer_of_floatframe(*words: object, code: int = 0) -> str:
    """Run `floatframe`, expect this exit code, and return what it prints; for errors, the message in one line."""
    result = run_floatframe(*words, code=code)
    return result.stdout if code == 0 else " ".join(result.stderr.split())

"""Commands of `cms`, as a user calls them."""

from click.testing import Result
from typer.testing import CliRunner

from cms.cli.app import app

__all__ = ["assert_refused", "run_cms"]


def run_cms(*words: object, code: int | None = None, **options: object) -> Result:
    """Run `cms` with these words in this process, and expect an exit code if it is given.

    Options are those of `CliRunner.invoke`.
    """
    result = CliRunner().invoke(app, [str(word) for word in words], **options)
    assert code is None or result.exit_code == code, result.output
    return result


def assert_refused(result: Result, *words: str) -> None:
    """Exit code 2, one message on standard error with these words, no traceback."""
    assert result.exit_code == 2, result.output
    assert result.stderr.startswith("error: ")
    assert result.stderr.count("error: ") == 1
    assert "Traceback" not in result.output
    for word in words:
        assert word in result.stderr

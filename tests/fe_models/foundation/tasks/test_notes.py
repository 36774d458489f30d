"""Warnings of a task: which are kept for its row, and which are shown at once."""

import logging

from fe_models.foundation.tasks.notes import recorded_notes

log = logging.getLogger("fe_models.example")


def test_warnings_are_kept_and_reports_of_progress_shown_at_once(caplog):
    with recorded_notes() as notes:
        log.warning("mass is large")
        log.warning("compiling", extra={"is_progress": True})
        assert caplog.messages == ["compiling"]
    assert notes == ["mass is large"]
    assert caplog.messages == ["compiling"]


def test_progress_is_shown_where_logging_has_no_handlers(monkeypatch, capsys):
    monkeypatch.setattr(logging.getLogger(), "handlers", [])
    with recorded_notes() as notes:
        log.warning("compiling", extra={"is_progress": True})
    assert notes == []
    assert "compiling" in capsys.readouterr().err

"""A headless browser that opens a page offline and tells what went wrong in it."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import pytest

PATIENCE = 240_000  #: [ms] for a page on a busy machine without a graphics card
NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
#: software rendering, so that WebGL is there on a machine without a graphics card
SWITCHES = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")


@dataclass
class Complaints:
    """What a page said that it should not."""

    errors: list[str] = field(default_factory=list)  #: exceptions, and messages of warning or error in the console
    requests: list[str] = field(default_factory=list)  #: of anything outside the page


@contextmanager
def browser() -> Iterator:
    """Give a headless browser; skip visibly where there is none.

    Where everything is required (FLOATFRAME_REQUIRE_ALL) the lack of a browser fails.
    """
    program = next((found for name in NAMES if (found := shutil.which(name))), None)
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        program, missing = None, "playwright is not installed"
    else:
        missing = f"none of {', '.join(NAMES)} is on the path"
    if program is None:
        if os.environ.get("FLOATFRAME_REQUIRE_ALL") == "1":
            pytest.fail(f"a browser is required here: {missing}")
        pytest.skip(f"no browser to open the report with: {missing}")
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=program, args=list(SWITCHES), timeout=PATIENCE)
        yield started
        started.close()


def opened(started, path, *, width=1360, height=900) -> tuple:
    """Return a page of that browser that shows the file without a network, and its complaints."""
    complaints = Complaints()
    page = started.new_page(viewport={"width": width, "height": height})
    page.set_default_timeout(PATIENCE)
    page.on("console", lambda message: note(complaints, message))
    page.on("pageerror", lambda error: complaints.errors.append(f"exception: {error}"))
    page.on("request", lambda request: outside(complaints, request.url, path))
    page.context.set_offline(True)
    page.goto(f"file://{path}")
    page.wait_for_selector("body[data-ready]")
    return page, complaints


def note(complaints: Complaints, message) -> None:
    if message.type in ("error", "warning") and "GPU stall due to ReadPixels" not in message.text:
        complaints.errors.append(f"{message.type}: {message.text}")


def outside(complaints: Complaints, url: str, path) -> None:
    if url != f"file://{path}" and not url.startswith(("data:", "blob:")):
        complaints.requests.append(url)

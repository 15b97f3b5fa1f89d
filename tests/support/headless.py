"""Viewers and browsers without a window; a test that cannot look is skipped with what to install."""

import io
import shutil
import subprocess

import numpy as np
import pytest

from replay.show.rerun_log.viewer import NO_ADAPTER, ViewerError


def viewer_or_skip(opens, *given, **more):
    """What ``opens`` gives, a viewer."""
    try:
        return opens(*given, **more)
    except ViewerError as error:
        if NO_ADAPTER in str(error):
            pytest.skip(f"no picture can be drawn: {NO_ADAPTER} (Debian: mesa-vulkan-drivers libvulkan1)")
        raise


def pixels(png):
    """A picture of a file's bytes, (rows, columns, 3) int16."""
    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), dtype=np.int16)


def photographed(page, folder, size):
    """Pixels of a page, HTML text, in a window of that size, and what the browser said."""
    said = _opened(page, folder, f"--screenshot={folder / 'page.png'}", f"--window-size={size}").stderr
    return pixels((folder / "page.png").read_bytes()), said


def page_after_its_scripts(page, folder):
    """The page as a browser has it two seconds later, as HTML."""
    return _opened(page, folder, "--dump-dom", "--virtual-time-budget=2000").stdout


def _opened(page, folder, *more):
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        pytest.skip("Chromium is not installed: install the package chromium to look at the page")
    (folder / "page.html").write_text(page, encoding="utf-8")
    words = [
        browser, "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
        "--disable-background-networking", "--disable-component-update", "--disable-sync", "--enable-logging=stderr",
        f"--user-data-dir={folder / 'profile'}", *more, (folder / "page.html").as_uri(),
    ]  # fmt: skip
    return subprocess.run(words, capture_output=True, text=True, timeout=120, check=True)

"""Chromium and viewers without a window, and every text of a recording."""

import base64
import io
import json
import os
import select
import shutil
import subprocess
import sys
import tarfile
from contextlib import contextmanager

import numpy as np
import psutil
import pytest
from rerun.chunk import RrdReader

from replay.show.rerun_log.viewer import NO_ADAPTER, ViewerError

FLAGS = (
    "--headless=new", "--no-sandbox", "--no-first-run", "--disable-quic", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--host-resolver-rules=MAP * ~NOTFOUND", "--remote-debugging-pipe",
    "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
)  # fmt: skip

PIPED = """import fcntl, os, sys
asked, answered = (fcntl.fcntl(int(one), fcntl.F_DUPFD, 10) for one in sys.argv[1:3])
os.dup2(asked, 3)
os.dup2(answered, 4)
os.execv(sys.argv[3], sys.argv[3:])
"""
"""Starts a program that reads from descriptor 3 and writes to 4, as Chromium does."""


class Page:
    """A page in a browser: it is asked and heard."""

    def __init__(self, process, to, back):
        self.process, self.to, self.back = process, to, back
        self.rest, self.number, self.said, self.session = b"", 0, [], {}

    def call(self, method, **given):
        self.number += 1
        message = {"id": self.number, "method": method, "params": given, **self.session}
        os.write(self.to, json.dumps(message).encode() + b"\0")
        while True:
            while b"\0" not in self.rest:
                assert select.select([self.back], [], [], 200)[0], f"{method}: no answer"
                more = os.read(self.back, 1 << 20)
                assert more, "the browser ended"
                self.rest += more
            text, _, self.rest = self.rest.partition(b"\0")
            answer = json.loads(text)
            if answer.get("id") == self.number:
                assert "error" not in answer, answer
                return answer["result"]
            self.said.append(answer)

    def ask(self, script):
        """Value of an expression of JavaScript, waited for if it is a promise."""
        result = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def wait_for(self, script, seconds=90):
        """Milliseconds after the page began at which an expression became true."""
        loop = f"const step = () => {script} ? done(performance.now()) : setTimeout(step, 50);"
        result = self.ask(f"new Promise(done => {{ {loop} setTimeout(() => done(0), {1000 * seconds}); step(); }})")
        assert result, f"never true: {script}"
        return result

    def processor_seconds(self):
        """Seconds that the browser has computed: on two idle cores no time is longer."""
        family = [self.process, *self.process.children(recursive=True)]
        return sum(sum(item.cpu_times()[:2]) for item in family)

    def png(self):
        return base64.b64decode(self.call("Page.captureScreenshot")["data"])

    def errors(self):
        """Errors that it wrote to the console, and those that it threw."""
        self.ask("1")
        kind = {
            "Runtime.exceptionThrown": lambda item: True,
            "Log.entryAdded": lambda item: item["entry"]["level"] == "error",
            "Runtime.consoleAPICalled": lambda item: item["type"] in ("error", "assert"),
        }
        return [item for item in self.said if item.get("method") in kind and kind[item["method"]](item["params"])]

    def requests(self):
        requested = (item["params"] for item in self.said if item.get("method") == "Network.requestWillBeSent")
        return [item["request"]["url"] for item in requested]


AXE = "axe-core@4.14.1"


def serious_faults(page, folder):
    """Faults that the accessibility checker axe calls serious or critical; skipped where npm cannot fetch it."""
    if shutil.which("npm") is None:
        pytest.skip("npm is not installed: install it to check accessibility")
    arguments = ["npm", "pack", AXE, "--silent", "--pack-destination", str(folder)]
    packed = subprocess.run(arguments, capture_output=True, text=True, timeout=120, check=False)
    if packed.returncode:
        pytest.skip(f"npm cannot fetch {AXE}")
    with tarfile.open(folder / packed.stdout.split()[-1]) as archive:
        page.ask(archive.extractfile("package/axe.min.js").read().decode() + ";0")
    result = json.loads(page.ask("axe.run().then(found => JSON.stringify(found.violations))"))
    return [(item["id"], item["nodes"][0]["html"]) for item in result if item["impact"] in ("serious", "critical")]


@contextmanager
def opened(url, folder, size=(1280, 800), scheme="light"):
    """A page of that size and colour scheme; skipped where there is no Chromium."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        pytest.skip("Chromium is not installed: install the package chromium to look at the page")
    (requested, to), (back, answered) = os.pipe(), os.pipe()
    arguments = [sys.executable, "-c", PIPED, str(requested), str(answered), browser, *FLAGS]
    arguments += [f"--user-data-dir={folder / 'profile'}", "about:blank"]
    process = subprocess.Popen(arguments, pass_fds=(requested, answered), stderr=subprocess.DEVNULL)
    os.close(requested)
    os.close(answered)
    page = Page(psutil.Process(process.pid), to, back)
    try:
        target = next(item for item in page.call("Target.getTargets")["targetInfos"] if item["type"] == "page")
        at = page.call("Target.attachToTarget", targetId=target["targetId"], flatten=True)
        page.session = {"sessionId": at["sessionId"]}
        for domain in ("Page", "Runtime", "Network", "Log"):
            page.call(f"{domain}.enable")
        width, height = size
        page.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        page.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        page.call("Page.navigate", url=url)
        page.wait_for(f"location.href === {json.dumps(url)} && document.readyState === 'complete'")
        yield page
    finally:
        process.kill()
        process.wait()
        os.close(to)
        os.close(back)


def viewer_or_skip(opens, *given, **more):
    """The viewer that ``opens`` gives."""
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
    output = _opened(page, folder, f"--screenshot={folder / 'page.png'}", f"--window-size={size}").stderr
    return pixels((folder / "page.png").read_bytes()), output


def page_after_its_scripts(page, folder):
    """The page as a browser has it two seconds later, as HTML."""
    return _opened(page, folder, "--dump-dom", "--virtual-time-budget=2000").stdout


def _opened(page, folder, *more):
    """The output of Chromium after it opened a page."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        pytest.skip("Chromium is not installed: install the package chromium to look at the page")
    (folder / "page.html").write_text(page, encoding="utf-8")
    text = [
        browser, "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
        "--disable-background-networking", "--disable-component-update", "--disable-sync", "--enable-logging=stderr",
        f"--user-data-dir={folder / 'profile'}", *more, (folder / "page.html").as_uri(),
    ]  # fmt: skip
    return subprocess.run(text, capture_output=True, text=True, timeout=120, check=True)


def recording_text(path):
    """Every text of a recording, of its layout too."""
    reader = RrdReader(path)
    result = []
    for store in (*reader.blueprints(), *reader.recordings()):
        for chunk in reader.stream(store=store).to_chunks():
            batch = chunk.to_record_batch()
            for column in batch.columns:
                if "string" in str(column.type):
                    result += _texts(column.to_pylist())
    return "\n".join(result)


def _texts(values):
    """Yields the texts of nested lists."""
    for value in values or ():
        yield from [value] if isinstance(value, str) else _texts(value)

"""The folder that a run is sent as: the report, the live picture beside it, and the recording; it opens by itself.

A browser reads no file for a page of ``file://`` but scripts, styles and pictures. So the recording and the viewer lie
packed in scripts; the viewer's, the largest, is there once for all runs. The page is made anew from summary and tables:
one that came with the folder is never passed on. It has no stills: every fault leads the picture to its moment.
"""

import gzip
import json
import shutil
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from replay.base.machine import versions
from replay.base.shown import plural
from replay.base.tables import Marked, table
from replay.errors import OutputError
from replay.outputs.report.markup import ALLOWED, Markup, element, page_html, rendered
from replay.outputs.report.page import page_of
from replay.outputs.report.run_view import Fault, Hero, RunView, fault_address, session_names
from replay.outputs.results.run_folder import PICTURE, FolderKind, RunFolder, result_folder, write_summary
from replay.pipeline.headline import held
from sessions.mcap_format.metadata import SHARE

SHARED: Final = FolderKind("shared", "share.json", "vrlab-replay/share/1")
INDEX: Final = "index.html"

WITH_PICTURE: Final = f"{ALLOWED}; script-src 'self' file: 'wasm-unsafe-eval'"
"""What a browser may load for the page: scripts of its own folder too. No other address: the viewer would call home."""

NOTE: Final = "The picture is drawn by Rerun {}, licensed under MIT and Apache 2.0; notices of others lie beside it."


def require_consent(folders: Sequence[RunFolder]) -> None:
    """Refuse recordings whose fact ``consent`` is not ``share``; ``OutputError`` says which and what to do."""
    consents = {str(one.path): one.summary["session"]["facts"].get("consent", "not stated") for one in folders}
    without = [f"{path} (consent: {words})" for path, words in consents.items() if words != SHARE]
    if without:
        what = f"not recorded as consent to share: {', '.join(without)}"
        raise OutputError(f"{what}; its motion can identify a person; where you may pass it on, add --anyway")


def write_shared_folder(folders: Sequence[RunFolder], out: Path, *, force: bool = False) -> str:
    """Write runs to a folder that opens by a double click on ``index.html``; why there is no picture, or nothing.

    Raises ``OutputError``: the folder exists or cannot be written; ``RunFolderError``: the recording of a run is none.
    """
    shown = [one for one in folders if (one.path / PICTURE).is_file()]
    viewer, why = _viewer() if shown else ({}, f"no run holds a picture ({PICTURE})")
    pages = {"run" if len(folders) == 1 else f"run{k}": one for k, one in enumerate(folders, 1)}
    titles: dict[str, str] = {}
    with result_folder(out, SHARED, force=force) as folder:
        for name, content in viewer.items():
            (folder / name).write_bytes(content)
        for name, one in pages.items():
            page = INDEX if len(pages) == 1 else f"{name}.html"
            titles[name] = _write_run(one, folder / page, name, pictured=bool(viewer) and one in shown)
        if len(pages) > 1:
            (folder / INDEX).write_text(_list(pages, titles), encoding="utf-8", newline="\n")
        told = {"schema": SHARED.schema, "runs": len(pages), "picture": bool(viewer)}
        write_summary(folder, SHARED, told)
    return why


def _viewer() -> tuple[dict[str, bytes], str]:
    from replay.outputs.rerun_log.viewer import ViewerError
    from replay.outputs.rerun_log.web_viewer import PROGRAM, web_viewer

    try:
        found = web_viewer()
    except ViewerError as error:
        return {}, str(error)
    script = files("replay.outputs.share").joinpath("picture.js").read_bytes()
    return found | {"viewer.js": _packed(found.pop(PROGRAM)), "picture.js": script}, ""


def _packed(content: bytes) -> bytes:
    return b'window.packed="' + b64encode(gzip.compress(content, 6, mtime=0)) + b'";\n'


def _write_run(run: RunFolder, page: Path, name: str, *, pictured: bool) -> str:
    """The page of a run, and where it is ``pictured`` its recording, as it is and packed; the title of the page."""
    view = folder_view(run, pictured=pictured)
    text = page_of(view, held(run))
    if pictured:
        recording, labels = run.path / PICTURE, list(run.summary["audit"])
        shutil.copyfile(recording, page.with_name(f"{name}.rrd"))
        packed = _moments(recording, labels) + _packed(recording.read_bytes())
        page.with_name(f"{name}.js").write_bytes(packed)
        text = _beside(text, name)
    page.write_text(text, encoding="utf-8", newline="\n")
    return view.title


def _moments(recording: Path, labels: Sequence[str]) -> bytes:
    from replay.outputs.rerun_log.web_viewer import moment_commands

    found = {name: b64encode(one).decode() for name, one in moment_commands(recording, labels).items()}
    return f"window.moments={json.dumps(found)};\n".encode()


def _beside(report: str, name: str) -> str:
    """The page of a report with the picture in it."""
    words, seen = "The picture is loading; the report can be read meanwhile.", "The session in motion, in 3D, by Rerun"
    canvas = element("canvas", tabindex=0, role="img", aria_label=seen)
    button = element("button", "Fill the screen", type="button")
    box = element("aside", element("p", words, role="status"), button, canvas, id="picture", aria_label="Picture")
    licence = element("p", NOTE.format(versions().get("rerun-sdk", "")))
    style = files("replay.outputs.share").joinpath("picture.css").read_text(encoding="utf-8")
    script = element("script", src="picture.js", defer="defer", data_recording=name)
    for before, after in {
        ALLOWED: WITH_PICTURE, "</head>": f"<style>{style}</style>{script}</head>", "</section>": f"</section>{box}",
        "</footer>": f"{licence}</footer>",
    }.items():  # fmt: skip
        report = report.replace(before, after, 1)
    return report


def _list(pages: dict[str, RunFolder], titles: dict[str, str]) -> str:
    rows: list[Sequence[Any]] = []
    for name, one in pages.items():
        who = one.summary["session"]["facts"].get("pseudonym", "")
        rows.append((Marked(name, to=f"{name}.html"), who, titles[name]))
    made = table("Runs", ("run", "who", "session and answer"), rows, words=3)
    title = plural(len(pages), "run")
    return page_html(title, [element("h1", title)], [rendered(made)])


def folder_view(run: RunFolder, *, pictured: bool) -> RunView:
    """A run as its folder holds it; ``pictured``: the picture stands beside the page, and each fault leads it there."""
    told, names = run.summary.get("tradeoff"), ", ".join(session_names(run.summary))
    hero = Hero(str(told["answer"]), told["advice"]) if told else None
    view = RunView(run, run.rows, names, hero)

    def look(fault: Fault) -> Markup:
        return element("p", element("a", "show it in the picture", href=f"#{fault_address(view, fault)}"))

    return replace(view, look=look) if pictured else view

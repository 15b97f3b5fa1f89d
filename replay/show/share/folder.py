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
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from replay.document.headline import grasped_notes
from replay.document.machine import versions
from replay.document.tables import Marked, table
from replay.errors import OutputError
from replay.show.report.markup import render_template
from replay.show.report.page import page_of
from replay.show.report.page_script import TABLES_SCRIPTS, page_script
from replay.show.report.run_view import Hero, RunView, session_names
from replay.show.results.run_folder import PICTURE_FILE, FolderKind, RunFolder, result_folder, write_summary
from sessions.mcap.metadata import SHAREABLE

SHARED_FOLDER: Final = FolderKind("shared", "share.json", "vrlab-replay/share/1")
INDEX_FILE: Final = "index.html"


def require_consent(folders: Sequence[RunFolder]) -> None:
    """Refuse recordings whose fact ``consent`` is not ``share``; ``OutputError`` says which and what to do."""
    consent_of_path = {str(run.path): run.document.session.facts.get("consent", "not stated") for run in folders}
    paths_without_consent = [
        f"{path} (consent: {consent})" for path, consent in consent_of_path.items() if consent != SHAREABLE
    ]
    if paths_without_consent:
        missing_consent = f"no consent to share is recorded: {', '.join(paths_without_consent)}"
        raise OutputError(f"{missing_consent}; motion can identify a person; if you have consent, add --anyway")


def write_shared_folder(folders: Sequence[RunFolder], out: Path, *, force: bool = False) -> str:
    """Write runs to a folder that opens by a double click on ``index.html``; why there is no picture, or nothing.

    Raises ``OutputError``: the folder exists or cannot be written; ``RunFolderError``: the recording of a run is none.
    """
    pictured_runs = [run for run in folders if run.has_picture]
    for run in pictured_runs:
        _require_whole(run.picture)
    viewer, no_picture_reason = _viewer_files() if pictured_runs else ({}, f"no run holds a picture ({PICTURE_FILE})")
    run_of_page = {"run" if len(folders) == 1 else f"run{k}": run for k, run in enumerate(folders, 1)}
    titles: dict[str, str] = {}
    with result_folder(out, SHARED_FOLDER, force=force) as folder:
        for name, content in viewer.items():
            (folder / name).write_bytes(content)
        for name, run in run_of_page.items():
            page = INDEX_FILE if len(run_of_page) == 1 else f"{name}.html"
            titles[name] = _write_run(run, folder / page, name, pictured=bool(viewer) and run in pictured_runs)
        if len(run_of_page) > 1:
            (folder / INDEX_FILE).write_text(list_page(run_of_page, titles), encoding="utf-8", newline="\n")
        folder_mark = {"schema": SHARED_FOLDER.schema, "runs": len(run_of_page), "picture": bool(viewer)}
        write_summary(folder, SHARED_FOLDER, folder_mark)
    return no_picture_reason


def _require_whole(picture: Path) -> None:
    """Refuse a damaged recording before the viewer is started, which takes seconds."""
    from replay.show.rerun_log.moments import read_bookmarks

    read_bookmarks(picture)


def _viewer_files() -> tuple[dict[str, bytes], str]:
    from replay.show.rerun_log.viewer import ViewerError
    from replay.show.rerun_log.web_viewer import PROGRAM_FILE, web_viewer

    try:
        viewer = web_viewer()
    except ViewerError as error:
        return {}, str(error)
    script = files("replay.show.share").joinpath("picture.js").read_bytes()
    return viewer | {"viewer.js": _packed_script(viewer.pop(PROGRAM_FILE)), "picture.js": script}, ""


def _packed_script(content: bytes) -> bytes:
    return b'window.packed="' + b64encode(gzip.compress(content, 6, mtime=0)) + b'";\n'


def _write_run(run: RunFolder, page: Path, page_name: str, *, pictured: bool) -> str:
    """The page of a run, and where it is ``pictured`` its recording, as it is and packed; the title of the page."""
    view = folder_view(run, pictured=pictured)
    if pictured:
        recording, labels = run.picture, list(run.document.audit)
        shutil.copyfile(recording, page.with_name(f"{page_name}.rrd"))
        packed_script = _moments_script(recording, labels) + _packed_script(recording.read_bytes())
        page.with_name(f"{page_name}.js").write_bytes(packed_script)
    page.write_text(
        shared_page(view, page_name, _leading_still(run) if pictured else ""), encoding="utf-8", newline="\n"
    )
    return view.title


def _moments_script(recording: Path, labels: Sequence[str]) -> bytes:
    from replay.show.rerun_log.web_viewer import moment_commands

    commands = {name: b64encode(data).decode() for name, data in moment_commands(recording, labels).items()}
    return f"window.moments={json.dumps(commands)};\n".encode()


def _leading_still(run: RunFolder) -> str:
    from replay.show.rerun_log.leading_still import read_still

    return read_still(run.picture)


def shared_page(view: RunView, recording: str, still: str = "") -> str:
    """The page of a run; ``recording`` is the name of its packed recording, ``still`` its leading fault as WebP."""
    rerun = versions().get("rerun-sdk", "")
    return page_of(view, grasped_notes(view.run), "show/share/page.html", recording=recording, rerun=rerun, still=still)


def list_page(pages: dict[str, RunFolder], titles: dict[str, str]) -> str:
    """The page that links to the pages of several runs, by name."""
    page_rows: list[Sequence[Any]] = []
    for name, run in pages.items():
        pseudonym = run.document.session.facts.get("pseudonym", "")
        page_rows.append((Marked(name, to=f"{name}.html"), pseudonym, titles[name]))
    run_table = table("Runs", ("run", "who", "session and answer"), page_rows, words=3)
    return render_template("show/share/list.html", runs=run_table, script=page_script(TABLES_SCRIPTS))


def folder_view(run: RunFolder, *, pictured: bool) -> RunView:
    """A run as its folder holds it; ``pictured``: the picture stands beside the page, and each fault leads it there."""
    tradeoff, session_names_text = run.document.tradeoff, ", ".join(session_names(run.document))
    hero = None if tradeoff is None else Hero(tradeoff.answer, tradeoff.advice)
    return RunView(run, session_names_text, hero, pictured=pictured)

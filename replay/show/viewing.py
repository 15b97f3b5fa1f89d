"""``replay.view`` and ``replay.share``: runs in a viewer of their own, and as a folder to send."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

PathLike = str | Path


def view(*runs: PathLike, miss: int | None = None, false: int | None = None, by: str = "") -> None:
    """Open the pictures of run folders in one viewer on this machine, and wait until its window is closed.

    Parameters
    ----------
    runs : run folders; the first is shown, and the cursor of each stands at the same second.
    miss, false : number of a miss or a false contact to open at; else the worst moment.
    by : label of the detector whose it is; else the first that has it.

    Raises ``ReplayError``: a folder is no run folder or has no picture, or there is no screen.
    """
    from replay.errors import RunFolderError
    from replay.show.rerun_log.viewer import open_viewer
    from replay.show.results.run_folder import read_run_folder

    if not runs:
        raise RunFolderError("there is no run to show; name at least one run folder")
    run_folders = [read_run_folder(run) for run in runs]
    with open_viewer(*(folder.picture for folder in run_folders), miss=miss, false=false, by=by) as viewer:
        viewer.process.wait()


def share(runs: PathLike | Sequence[PathLike], out: PathLike, *, anyway: bool = False, force: bool = False) -> Path:
    """Write a folder that shows runs in any browser without a network, and return its ``index.html``.

    Parameters
    ----------
    runs : a run folder, or several.
    out : folder to write; ``force`` replaces an earlier one.
    anyway : also what was not recorded with the fact ``consent=share``.

    Raises ``ReplayError``: no run folder, no consent, or a folder in the way.
    """
    from replay.show.share.folder import INDEX_FILE

    run_list: Sequence[Any] = runs if isinstance(runs, list | tuple) else [runs]
    write_shared(run_list, Path(out), anyway=anyway, force=force)
    return Path(out) / INDEX_FILE


def write_shared(runs: Sequence[PathLike], out: Path, *, anyway: bool, force: bool) -> str:
    """Writes the folder of ``share``; returns why it holds no picture, ``""`` if it holds one."""
    from replay.show.results.run_folder import check_target, read_run_folder
    from replay.show.share.folder import SHARED_FOLDER, require_consent, write_shared_folder

    check_target(out, force=force, kind=SHARED_FOLDER)
    run_folders = [read_run_folder(run) for run in runs]
    if not anyway:
        require_consent(run_folders)
    return write_shared_folder(run_folders, out, force=force)

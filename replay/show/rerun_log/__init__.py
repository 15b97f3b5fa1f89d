"""The picture: a Rerun recording of a run, its blueprint and its viewer. A view, never the archive.

Importing it says in one sentence where the installed Rerun is another than these modules are written for.
"""

from importlib.metadata import PackageNotFoundError, version
from typing import Final

from replay.errors import OutputError

RERUN: Final = "0.41"
"""The minor version, which pyproject.toml pins; names of Rerun come and go with every one."""


def require_rerun() -> None:
    """Raise ``OutputError`` where the installed Rerun is older or newer than ``RERUN``, or none."""
    try:
        installed = version("rerun-sdk")
    except PackageNotFoundError:
        installed = ""
    if installed.split(".")[:2] != RERUN.split("."):
        which = f"rerun-sdk {installed} is installed" if installed else "rerun-sdk is not installed"
        todo = f'pip install "rerun-sdk=={RERUN}.*", or leave the picture out with --no-picture'
        raise OutputError(f"{which}, and pictures need {RERUN}; {todo}")


require_rerun()

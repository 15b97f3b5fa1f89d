"""The picture: a Rerun recording of a run, its blueprint and its viewer. A view, never the archive.

Importing it says in one sentence where the installed Rerun is another than these modules are written for.
"""

from importlib.metadata import PackageNotFoundError, version
from typing import Final

from replay.errors import OutputError

RERUN_VERSION: Final = "0.41"
"""The minor version, which pyproject.toml pins; names of Rerun come and go with every one."""


def require_rerun() -> None:
    """Raise ``OutputError`` where the installed Rerun is older or newer than ``RERUN_VERSION``, or none."""
    try:
        installed_version = version("rerun-sdk")
    except PackageNotFoundError:
        installed_version = ""
    if installed_version.split(".")[:2] != RERUN_VERSION.split("."):
        installed_sentence = (
            f"rerun-sdk {installed_version} is installed" if installed_version else "rerun-sdk is not installed"
        )
        todo = f'pip install "rerun-sdk=={RERUN_VERSION}.*", or leave the picture out with --no-picture'
        raise OutputError(f"{installed_sentence}, and pictures need {RERUN_VERSION}; {todo}")


require_rerun()

"""Why a session file is refused: one table for every verb, code -> what to do about it.

`info` and `run` stop at the first refusal, the doctor lists them as errors under these codes, and `recover` leaves out
what a refusal is about, or repeats it where nothing else is there. So no verb accepts what another one refuses.
"""

from pathlib import Path
from typing import Final

from sessions.errors import SessionFileError

_RECOVER: Final = "save the rest with `replay recover`"
CURES: Final = {
    "not-mcap": "if another program wrote it, bring it in: replay import auto FILE -o session.mcap",
    "torn": "save what is there with `replay recover`",
    "unreadable": _RECOVER,
    "damaged-chunk": _RECOVER,
    "bad-message": _RECOVER,
    "too-much": "split the recording, or export less of it",
    "damaged-attachment": _RECOVER,
    "mesh-hash": _RECOVER,
    "mesh-unreadable": _RECOVER,
    "mesh-empty": _RECOVER,
    "bad-scene": _RECOVER,
    "unknown-version": "install a newer vrlab-replay, or record or import it again",
    "unknown-frame": "write all poses in one frame",
    "bad-names": _RECOVER,
    "unlisted-body": _RECOVER,
    "no-poses": (
        "if another program wrote it, bring it in: replay import mcap FILE -o session.mcap; else write poses as "
        "foxglove.FrameTransforms in protobuf on /tf"
    ),
}
"""Code of a refusal, which is the doctor's, too -> the cure."""
FILE: Final = "FILE"
"""Stands in a cure for the file that is refused."""
TOO_MANY: Final = "its messages hold more bodies than those of a file of its size"
"""Of what is too much, the one sentence of all who count bodies in messages."""


def refusal(path: Path | str, code: str, what: str, cure: str = "") -> SessionFileError:
    """One sentence about a file, with the cure, which is that of the code where no other is given."""
    error = SessionFileError(f"{path}: {what}; {cure or CURES[code].replace(FILE, str(path))}")
    error.code, error.what = code, what
    return error


def brief(error: SessionFileError) -> str:
    """The problem, without the file and the cure."""
    return error.what or str(error).partition(": ")[2] or str(error)

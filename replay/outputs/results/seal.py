"""The seal of a run folder with a proof: a hash of the recording, of every file, and of the seal itself."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

from replay.errors import RunFolderError
from replay.proof.claims import WrongRecord

PROOF: Final = "proof.npz"
SEAL: Final = "proof.json"
SEAL_SCHEMA: Final = "vrlab-replay/seal/1"


def file_hash(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def write_seal(folder: Path, recording: Path) -> None:
    """Write the hashes of a recording and of every file of a run folder; the last file to be written."""
    names = sorted(entry.name for entry in folder.iterdir() if entry.name != SEAL)
    files = {name: file_hash(folder / name) for name in names}
    plain = {"schema": SEAL_SCHEMA, "recording": file_hash(recording), "files": files}
    (folder / SEAL).write_text(_sealed(plain), encoding="utf-8", newline="\n")


def _sealed(plain: Mapping[str, Any]) -> str:
    """The text of a seal: its own hash stands in it, and there is one way to write it."""
    body = {key: value for key, value in plain.items() if key != "seal"}
    seal = hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()
    return json.dumps({**body, "seal": seal}, indent=1, sort_keys=True) + "\n"


def read_seal(folder: Path, needed: Iterable[str]) -> dict[str, Any]:
    """The seal of a folder whose files are as they were written; ``WrongRecord``: they are not, or one is missing."""
    try:
        text = (folder / SEAL).read_text("utf-8")
        seal: dict[str, Any] = json.loads(text)
        names = dict(seal["files"])
        whole = seal["schema"] == SEAL_SCHEMA and _sealed(seal) == text and names.keys() >= {*needed}
    except FileNotFoundError as error:
        raise RunFolderError(f"{folder} holds no proof; make one with `replay run --proof`") from error
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise WrongRecord(f"{SEAL} cannot be read ({error})") from error
    if not whole:
        raise WrongRecord(f"{SEAL} is not as it was written")
    for name, digest in names.items():
        path = folder / name
        if Path(name).name != name or not path.is_file() or file_hash(path) != digest:
            raise WrongRecord(f"{name} is not the file that was written")
    return seal

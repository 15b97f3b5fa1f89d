"""The hash by which a file is known."""

import hashlib
from pathlib import Path


def file_hash(path: Path) -> str:
    """SHA-256 of the bytes of a file, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()

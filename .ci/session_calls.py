"""Count the files and functions of `sessions` between a file and its first block of frames.

    NUMBA_DISABLE_JIT=1 python .ci/session_calls.py        --list names them

Modules are loaded by a first reading, so that only calls count; comprehensions and lambdas belong to their function.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Final

import numpy as np

import sessions
from sessions import Session, read_session, write_session
from sessions.importers import import_session

ROOT: Final = Path(sessions.__file__).parent.parent
MAPPING: Final = """convention = "ros"
units = "m"
[time]
column = "t"
unit = "s"
[bodies.cup]
position = ["x", "y", "z"]
quaternion_xyzw = ["qx", "qy", "qz", "qw"]
"""


def write_recordings(folder: Path) -> None:
    """Write take.mcap, take.csv and map.toml: 200 frames of a cup without a mesh."""
    seconds = np.arange(200) / 90.0
    positions = np.stack([0.1 * seconds, np.ones(200), np.zeros(200)], axis=1)
    upright = np.tile([0.0, 0.0, 0.0, 1.0], (200, 1))
    stamps = (seconds * 1e9).astype(np.int64)
    write_session(Session.from_arrays(stamps, {"cup": (positions, upright)}), folder / "take.mcap")
    table = np.column_stack([seconds, positions, upright])
    np.savetxt(folder / "take.csv", table, delimiter=",", fmt="%.6f", header="t,x,y,z,qx,qy,qz,qw", comments="")
    (folder / "map.toml").write_text(MAPPING)


def called_functions(reading: Callable[[], Session]) -> set[tuple[str, str]]:
    """Return file and name of every function of this project that a reading calls up to its first block."""
    called = set()

    def note(frame: FrameType, event: str, _argument: object) -> None:
        code = frame.f_code
        path = Path(code.co_filename)
        if event == "call" and path.is_relative_to(ROOT) and path.relative_to(ROOT).parts[0] == "sessions":
            called.add((str(path.relative_to(ROOT)), code.co_qualname.partition(".<locals>.<")[0]))

    next(iter(reading().blocks(100)))
    sys.setprofile(note)
    try:
        next(iter(reading().blocks(100)))
    finally:
        sys.setprofile(None)
    return called


def functions_by_format() -> dict[str, set[tuple[str, str]]]:
    """Return the called functions of a recorder's MCAP and of a CSV with a mapping."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_recordings(folder)
        return {
            "MCAP": called_functions(lambda: read_session(folder / "take.mcap")),
            "CSV": called_functions(lambda: import_session("csv", folder / "take.csv", mapping=folder / "map.toml")),
        }


def main() -> None:
    """Print a line for each format."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--list", action="store_true")
    given = parser.parse_args()
    for label, called in functions_by_format().items():
        files = sorted({file for file, _ in called})
        print(f"{label}: {len(files)} files, {len(called)} functions")
        for file in files if given.list else ():
            print(f"  {file}: {', '.join(sorted(function for path, function in called if path == file))}")


if __name__ == "__main__":
    main()

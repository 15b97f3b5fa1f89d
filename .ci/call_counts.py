"""Files and functions of ``cdcore`` that one question passes, from the detector down to two triangles.

``python .ci/call_counts.py`` asks ``exact`` about two overlapping bodies in one pose, with kernels interpreted, since
compiled ones report no call. Detectors can be named. It says too how many of them are in ``cdcore/kernels``: these
stand for operations of the machine, such as a load of eight doubles. ``--list`` names all.
"""

import argparse
import os
import subprocess
import sys
from pathlib import Path

TOP = Path(__file__).parents[1]
CORE = TOP / "cdcore"


def main(names: list[str], *, listed: bool) -> None:
    """Print one line for each detector, and names if ``listed``."""
    from cdcore import Body, Motion, TriangleMesh, create_detector

    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    tetrahedron = TriangleMesh(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    bodies = [Body("a", tetrahedron), Body("b", tetrahedron)]
    motion = Motion([0.0], [[[0, 0, 0], [0.3, 0.2, 0.1]]], [[[[1, 0, 0], [0, 1, 0], [0, 0, 1]]] * 2])
    for name in names:
        detector = create_detector(name, bodies)
        # The first question imports modules and fills caches.
        detector.detect(motion)
        entered = called_in(lambda detector=detector: detector.detect(motion))
        files = sorted({file for file, _ in entered})
        operations = [file for file, _ in entered if file.startswith("kernels/")]
        print(
            f"{name}: {len(files)} files, {len(entered)} functions; "
            f"in cdcore/kernels {len(set(operations))} of the files, {len(operations)} of the functions"
        )
        for file in files if listed else ():
            print(f"  {file}: {', '.join(sorted(function for path, function in entered if path == file))}")


def called_in(question) -> set[tuple[str, str]]:
    """Returns file and qualified name of every function of the core that the question calls."""
    entered = set()

    def note(frame, event, _argument) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(str(CORE)) and "<" not in code.co_name:
            entered.add((str(Path(code.co_filename).relative_to(CORE)), code.co_qualname))

    sys.setprofile(note)
    try:
        question()
    finally:
        sys.setprofile(None)
    return entered


if __name__ == "__main__":
    if os.environ.get("NUMBA_DISABLE_JIT") != "1":
        environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(TOP)}
        raise SystemExit(subprocess.call([sys.executable, *sys.argv], env=environment))
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*", default=["exact"])
    parser.add_argument("--list", action="store_true")
    given = parser.parse_args()
    main(given.names, listed=given.list)

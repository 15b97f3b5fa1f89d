"""Files and functions of ``cdcore`` that one question passes, from the detector down to two triangles.

``python .ci/call_counts.py`` asks ``exact`` about two overlapping bodies in one pose, with kernels interpreted, since
compiled ones report no call. Detectors can be named.
"""

import os
import subprocess
import sys
from pathlib import Path

TOP = Path(__file__).parents[1]
CORE = str(TOP / "cdcore")


def main(names: list[str]) -> None:
    """Print one line for each detector."""
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
        files = {file for file, _ in entered}
        print(f"{name}: {len(files)} files, {len(entered)} functions")


def called_in(question) -> set[tuple[str, str]]:
    """Returns file and qualified name of every function of the core that the question calls."""
    entered = set()

    def note(frame, event, _argument) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(CORE) and "<" not in code.co_name:
            entered.add((code.co_filename, code.co_qualname))

    sys.setprofile(note)
    try:
        question()
    finally:
        sys.setprofile(None)
    return entered


if __name__ == "__main__":
    names = sys.argv[1:] or ["exact"]
    if os.environ.get("NUMBA_DISABLE_JIT") != "1":
        environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(TOP)}
        raise SystemExit(subprocess.call([sys.executable, __file__, *names], env=environment))
    main(names)

"""Compiles kernels before tests ask for them; ``compile_first.py FILE`` makes FILE when the common ones are there."""

import shutil
import sys
from pathlib import Path

from support.shapes import lab

from cdcore import DETECTORS, create_detector, detect_live
from cdcore.detectors.compile_beside import compile_kernels

COMMON = ("exact", "hybrid-qaco", "discrete")
"""Their kernels are those of most tests; the other detectors are left to compile while tests run."""
LONGEST = ("continuous",)
"""What takes longest to compile comes first of the others."""

if __name__ == "__main__":
    said = Path(sys.argv[1])
    try:
        compile_kernels()
        bodies, motion = lab(8)
        for name in dict.fromkeys([*COMMON, *LONGEST, *DETECTORS]):
            detector = create_detector(name, bodies)
            detector.detect(motion, faces=True)
            if detector.online:
                detect_live(detector, motion)
            if name == COMMON[-1]:
                said.touch()
    except BaseException:
        shutil.rmtree(said.parent)  # whoever waits for the file goes on and compiles itself
        raise

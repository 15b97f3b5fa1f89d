"""Compiles kernels before tests ask for them; run as a program, which says a word when the common ones are there."""

from support.shapes import lab

from cdcore import DETECTORS, create_detector

COMMON = ("exact", "hybrid-qaco", "discrete")
"""Their kernels are those of most tests; the other detectors are left to compile while tests run."""

if __name__ == "__main__":
    bodies, motion = lab(8)
    for name in dict.fromkeys([*COMMON, *DETECTORS]):
        create_detector(name, bodies).detect(motion)
        if name == COMMON[-1]:
            print("compiled", flush=True)

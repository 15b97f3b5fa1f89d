"""Steps of collecting hydrogen from zinc and acid: a tube is set on the flask, a jar held over the tube's mouth.

Hydrogen is lighter than air, so the jar stands on its mouth and the tube leads up into it (upward delivery).
"""

import numpy as np

from sessions.synthetic.bench import BENCH_TOP
from sessions.synthetic.experiments.lab import UP, Lab
from sessions.synthetic.paths import minimum_jerk_inverse

ZINC_MOLAR_MASS = 65.38  # IUPAC abridged atomic weights 2021
JAR_HEIGHT = 0.1991
# The tube ends this far inside the jar, and is lowered over from this far above.
TUBE_LENGTH, TUBE_IN_FLASK = 0.45, 0.11
LOWER_BY, LOWER_S, INSIDE_BY = 0.12, 1.8, 0.09


def set_tube(lab: Lab) -> None:
    """Put the tube on the flask, its lower end inside."""
    flask = np.array(lab.where["flask"][0])
    mouth = float(lab.layout.mesh("flask").bounds[1, 1])
    lab.grasp("left", "tube", (0.0, 0.3, 0.0))
    seat = flask + (mouth - TUBE_IN_FLASK) * UP
    lab.carry("left", seat + 0.16 * UP, high=BENCH_TOP + 0.28)
    lab.place("left", seat)
    lab.leave("left", 0.22)
    x, y, z = lab.hands["left"].position
    lab.hands["left"].go((x - 0.2, y, z + 0.1))
    lab.hands["left"].go((-0.28, 1.12, 0.28))


def collect_gas(lab: Lab) -> None:
    """Lower the jar over the tube, wait, lift it off; what is collected follows from the reaction's rate."""
    top = np.array(lab.where["tube"][0]) + TUBE_LENGTH * UP
    lab.grasp("right", "jar", (0.0, 0.12, 0.0))
    over = top + (JAR_HEIGHT + LOWER_BY - INSIDE_BY) * UP
    lab.carry("right", over, high=float(over[1]))
    script = lab.hands["right"]
    start = script.now
    lab.carry("right", over - LOWER_BY * UP, LOWER_S)
    share = 1.0 - INSIDE_BY / LOWER_BY
    entered = start + LOWER_S * minimum_jerk_inverse(share) + lab.late
    script.wait(22.0)
    out = script.now
    script.quiet.append((start, out + LOWER_S))
    lab.carry("right", over, LOWER_S)
    left = out + LOWER_S * minimum_jerk_inverse(1.0 - share) + lab.late
    begun = lab.last("pour").start
    moles, rate = lab.held_by("flask")["solid"]["mass_g"] / ZINC_MOLAR_MASS, lab.declared("reaction")["rate_per_s"]
    evolved = [moles * (1.0 - float(np.exp(-rate * (time - begun)))) for time in (entered, left)]
    lab.fact(
        "collect", entered, left, ("jar", "tube"),
        collected_mol=evolved[1] - evolved[0], leaked_before_mol=evolved[0], begun=begun, zinc_mol=moles,
    )  # fmt: skip
    lab.put_back("right", float(over[1]), rest=True)

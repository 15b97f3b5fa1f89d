"""Silver chloride: silver nitrate is poured into sodium chloride, a white precipitate falls, and is stirred."""

from sessions.synthetic.experiments.lab import Lab
from sessions.synthetic.experiments.steps import come_close, look_first, pour_once, rap, stir_once

POURED_ML = 18.0
# g/mol: Ag 107.868 + Cl 35.45 (IUPAC standard atomic weights, abridged, 2021).
SILVER_CHLORIDE = 143.32


def perform(lab: Lab) -> None:
    """Look, pour, stir, come too close."""
    look_first(lab, "look at the bench", ((0.1, 0.95, 0.0), 4.0), ((-0.1, 0.95, 0.0), 3.5), rest=3.0)
    task = "pour silver nitrate into sodium chloride"
    start = pour_once(lab, task, "silver-nitrate", "sodium-chloride", POURED_ML)
    moles = POURED_ML * 1e-3 * lab.held_by("silver-nitrate")["liquid"]["molar"]
    lab.fact(
        "precipitate", start, lab.now, ("sodium-chloride",), formula="AgCl", moles=moles, mass_g=moles * SILVER_CHLORIDE
    )
    with lab.task("stir"):
        stir_once(lab, "sodium-chloride", touches=(0.022, 0.25, 0.024))
    lab.stage("embodied cognition")
    with lab.task("look at the precipitate"):
        lab.look((-0.05, 0.95, 0.02))
        come_close(lab, "left", "sodium-chloride", 0.055, 0.004)
        lab.wait(2.0)
        rap(lab, "left", "sodium-chloride", 0.055, 0.3, note="knuckles touch the beaker")
        lab.rest("left")
        lab.wait(6.0)

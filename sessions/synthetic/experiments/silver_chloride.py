"""Silver chloride: silver nitrate is poured into sodium chloride, a white precipitate falls, and is stirred."""

from sessions.synthetic.experiments.lab import Lab
from sessions.synthetic.experiments.record import experiment
from sessions.synthetic.experiments.steps import come_close, pour, rap, stir

POURED_ML = 18.0
# g/mol: Ag 107.868 + Cl 35.45 (IUPAC standard atomic weights, abridged, 2021).
SILVER_CHLORIDE = 143.32


def perform(lab: Lab) -> None:
    """Look, pour, stir, come too close."""
    lab.stage("virtual reality")
    with lab.task("look at the bench"):
        lab.look((0.1, 0.95, 0.0), after=4.0)
        lab.look((-0.1, 0.95, 0.0), after=3.5)
        lab.wait(3.0)
    lab.stage("perceptual interaction")
    with lab.task("pour silver nitrate into sodium chloride"):
        lab.grasp("right", "silver-nitrate", (0.0, 0.05, 0.0))
        pour(lab, "right", "sodium-chloride", POURED_ML, seconds=5.0)
        start = max(fact.start for fact in lab.facts if fact.kind == "pour")
        lab.put_back("right")
    moles = POURED_ML * 1e-3 * lab.held_by("silver-nitrate")["liquid"]["molar"]
    lab.note(
        "precipitate", start, lab.now, ("sodium-chloride",), formula="AgCl", moles=moles, mass_g=moles * SILVER_CHLORIDE
    )
    with lab.task("stir"):
        lab.grasp("right", "rod", lab.layout.site("rod", "grip"))
        stir(lab, "right", "sodium-chloride", 12.0, radius=0.009, touches=(0.022, 0.25, 0.024))
        lab.put_back("right", 1.15, 0.05, rest=True)
    lab.stage("embodied cognition")
    with lab.task("look at the precipitate"):
        lab.look((-0.05, 0.95, 0.02))
        come_close(lab, "left", "sodium-chloride", 0.055, 0.004)
        lab.wait(2.0)
        rap(lab, "left", "sodium-chloride", 0.055, 0.3, note="knuckles touch the beaker")
        lab.rest("left")
        lab.wait(6.0)


SILVER_CHLORIDE_EXPERIMENT = experiment("silver-chloride", perform)

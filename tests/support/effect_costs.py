"""Cost of the effects of every made-up experiment, as rows of a table of the guide.

    python tests/support/effect_costs.py

prints the table of *What an effect costs* in `replay/guide/scenes-and-effects.md` again.
"""

import replay
from sessions.synthetic.scenes import SCENES


def row(scene):
    """One row: share of the run's time of each effect in the second run of a process, and the effects not run."""
    session, _ = replay.synthetic_session(scene)
    replay.run(session, detectors=())
    document = replay.run(session, detectors=()).document
    fractions = ", ".join(f"{kind} {100.0 * effect.fraction:.1f} %" for kind, effect in document.effects.items())
    rest = ", ".join(f"`{kind}`" for kind in document.plan.not_run)
    return f"| `{scene}` | {fractions} | {rest}{'' if document.plan.detection else '; no collision query is made'} |"


if __name__ == "__main__":
    print("| scene | share of the run's time | not run |\n|---|---|---|")
    for name in SCENES:
        if replay.synthetic_session(name)[0].scene.effects:
            print(row(name))

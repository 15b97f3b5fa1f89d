"""Cost of the effects of every made-up experiment, as rows of a table of the guide.

    python .ci/effect_costs.py

prints the table of *What an effect costs* in `replay/guide/scenes-and-effects.md` again.
"""

import replay
from sessions.synthetic.scenes import SCENES


def row(scene):
    """Share of the run's time of each effect in the second run of a process, and how many effects do not run."""
    session, _ = replay.synthetic_session(scene)
    replay.run(session, detectors=())
    document = replay.run(session, detectors=()).document
    fractions = ", ".join(f"{kind} {100.0 * effect.fraction:.1f} %" for kind, effect in document.effects.items())
    queries = "" if document.plan.detection else "; no collision query"
    return f"| `{scene}` | {fractions} | {len(document.plan.not_run)}{queries} |"


if __name__ == "__main__":
    print("| scene | share of the run's time | effects not run |\n|---|---|---|")
    for name in SCENES:
        if replay.synthetic_session(name)[0].scene.effects:
            print(row(name))

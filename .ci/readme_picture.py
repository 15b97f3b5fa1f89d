"""README's picture, made from the demo: ``python .ci/readme_picture.py .github/pictures/answer.png``.

On the left the worst moment as the report draws it; beside it what the detector says and what the surfaces say; below
the minute of both. A dark plate with clear corners, so that it stands on white and on dark. Chromium draws it.
"""

import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from replay import words
from replay.auditing.episodes import column_runs
from replay.auditing.outcome import Outcome
from replay.engine import compute
from replay.show.palette import FALSE_CONTACT, MISSED, PAPER, TRUE_CONTACT, WITHIN_TOLERANCE, hex_of
from replay.show.report.still import FIRST_SIZE, fault_still
from replay.studies.synthetic_sessions import synthetic_session

SIZE = (1800, 760)
"""Pixels; README shows half of them, so letters are 32 pixels high at least."""

LANE = (300, 1440)
"""Where lanes begin, and how wide a session is."""

THINNEST = 5.0
"""Pixels of a contact at least: one of 11 ms in a minute would not be seen."""

STYLE = """
@page { margin: 0 } body { margin: 0; background: transparent }
svg text { font-family: Inter, "DejaVu Sans", sans-serif; fill: #b9c4d2; font-size: 34px }
svg .big { font-size: 84px; font-weight: 800; fill: #fff } svg .false { fill: #ffd02e } svg .strong { fill: #fff }
svg .bold { font-weight: 700 }
svg .still text { font-size: 23px; font-weight: 700; fill: #fff } svg .still .c2 { display: none }
svg .still .c.yellow { fill: #ffd02e } svg .still .c.blue { fill: #9cc9f5 }
.still path, .still circle { fill: none; stroke: #fff }
.still .lead { stroke-opacity: .7; stroke-width: 1.2 } .still .lead.yellow { stroke: #ffd02e }
.still .halo { stroke: #0c121a; stroke-opacity: .7; stroke-width: 5 } .still .arrow { stroke-width: 2.2 }
"""

PLATE = "#121a25"

STOPS = f'<stop stop-color="{PLATE}" stop-opacity="0"/><stop offset="1" stop-color="{PLATE}"/></linearGradient>'
FADES = f"""
<linearGradient id="across">{STOPS}<linearGradient id="down" x2="0" y2="1">{STOPS}
<rect x="290" width="181" height="353" fill="url(#across)"/><rect y="320" width="471" height="33" fill="url(#down)"/>"""
"""Where the ground of the still goes over into the plate, in units of the still."""


def mixed(colour, other, share):
    """A colour with this share of another one in it."""
    return tuple(round(a + share * (z - a)) for a, z in zip(colour[:3], other[:3], strict=True))


REFERENCE = mixed(WITHIN_TOLERANCE, PAPER, 0.5)
RIGHT, LATE = mixed(TRUE_CONTACT, PAPER, 0.2), mixed(MISSED, PAPER, 0.5)


def main(out: Path) -> None:
    """Replay the demo, draw, keep."""
    session, _ = synthetic_session("bench-bumps", 0, None)
    drawn_picture(compute(session), out)


def drawn_picture(result, out):
    """The file of the picture of a run."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        sys.exit("Chromium is not installed: install the package chromium to draw the picture")
    with TemporaryDirectory() as folder:
        page = Path(folder) / "page.html"
        svg = readme_picture(result)
        page.write_text(f"<!doctype html><meta charset=utf-8><style>{STYLE}</style>{svg}", encoding="utf-8")
        subprocess.run(
            [browser, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run",
             "--disable-background-networking", "--default-background-color=00000000", f"--screenshot={out.resolve()}",
             f"--window-size={SIZE[0]},{SIZE[1]}", f"--user-data-dir={folder}/profile", page.as_uri()],
            check=True, capture_output=True,
        )  # fmt: skip
    return out


def readme_picture(result):
    """The picture as SVG; all its figures are those of the run."""
    answer, rank = result.answers[0], result.ranking[0]
    fault = next(item for item in result.false[answer.label] if item.number == answer.moment.number)
    still = str(fault_still(result, answer.label, fault, FIRST_SIZE))
    still = still.replace("<svg ", f"<svg width={FIRST_SIZE[0]} height={FIRST_SIZE[1]} ", 1).replace(
        "/>", f"/>{FADES}", 1
    )
    scale = 540 / FIRST_SIZE[1]
    fraction = words.as_percentage(rank.false.value)
    lines = [
        (770, 92, "", "The convex hull says:"), (770, 176, "big false", "contact."),
        (770, 262, "", f"The {fault.evidence.hollow} says:"), (770, 346, "big", f"{words.length(fault.metres)} apart."),
        (770, 436, "strong", f"<tspan class='false bold'>{fraction}</tspan> of the hull's contact time is false."),
    ]  # fmt: skip
    texts = [f'<text class="{kind}" x="{x}" y="{y}">{text}</text>' for x, y, kind, text in lines]
    legend = (("reference", REFERENCE), ("right", RIGHT), ("late", LATE), ("false", FALSE_CONTACT))
    x = 770
    for word, colour in legend:
        texts.append(f'<rect x="{x}" y="486" width="26" height="26" rx="5" fill="{hex_of(colour)}"/>')
        texts.append(f'<text x="{x + 38}" y="511">{word}</text>')
        x += 76 + 21 * len(word)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{SIZE[0]}" height="{SIZE[1]}">'
        f'<clipPath id="plate"><rect width="{SIZE[0]}" height="{SIZE[1]}" rx="28"/></clipPath>'
        f'<g clip-path="url(#plate)"><rect width="{SIZE[0]}" height="{SIZE[1]}" fill="{PLATE}"/>'
        f'<g transform="scale({scale})">{still}</g>'
        f"{''.join(texts)}{''.join(lanes(result, answer.label))}</g></svg>"
    )


def lanes(result, label):
    """The session as the reference and one detector see it, without what a hand holds."""
    outcome, motion = result.comparisons[label].outcome, result.assembly.motion
    last = float(motion.times[-1])
    missed = np.zeros(len(outcome), dtype=bool)
    for miss in result.misses[label]:
        missed[miss.first : miss.last + 1] = True
    truth = np.isin(outcome, (Outcome.BOTH, Outcome.MISSED)).any(axis=1)
    layers = [
        (576, "reference", [(truth, REFERENCE)]),
        (638, "convex hull", [((outcome == Outcome.FALSE_CONTACT).any(axis=1), FALSE_CONTACT),
                              ((outcome == Outcome.BOTH).any(axis=1), RIGHT), (missed, LATE)]),
    ]  # fmt: skip
    for y, name, states in layers:
        yield f'<text x="46" y="{y + 34}">{name}</text>'
        yield f'<rect x="{LANE[0]}" y="{y}" width="{LANE[1]}" height="46" rx="5" fill="#27313f"/>'
        for state, colour in states:
            for _, first, end in column_runs([state]).tolist():
                start = LANE[1] * float(motion.times[first]) / last
                width = max(THINNEST, LANE[1] * float(motion.times[end]) / last - start)
                rectangle = f'x="{LANE[0] + start:.1f}" y="{y}" width="{width:.1f}" height="46"'
                yield f'<rect {rectangle} fill="{hex_of(colour)}"/>'
    for second in range(0, round(last), 10):
        x = LANE[0] + LANE[1] * second / last
        yield f'<text x="{x:.0f}" y="728" text-anchor="{"middle" if second else "start"}">{second}</text>'
    yield f'<text x="{LANE[0] + LANE[1]}" y="728" text-anchor="end">{last:.0f} s</text>'


if __name__ == "__main__":
    main(Path(sys.argv[1]))

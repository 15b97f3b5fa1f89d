"""T1d: a look at every n-th frame misses contacts that fit between its looks, and time of the others.

The truth is continuous: contacts of the whole way between recorded poses, their ends looked for between frames. Every
phase of the looks is taken, because where they fall is chance. The session is made up, and half of its contacts are
planted to last 16 to 24 ms: how many are brief is by design, what a rate loses of them is found.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore import create_detector
from cdcore.numerics import BoolArray, FloatArray
from cdcore.protocol import counts_as_contact
from replay.base.constants import HEADSET_HZ
from replay.base.wilson import wilson
from replay.comparison.contact_duration import contact_durations
from replay.comparison.episodes import episodes
from replay.outputs.paper_table import Cell, PaperTable
from replay.prepare.assemble import assemble
from replay.studies.paper.printed import PRINTED, SECONDS
from replay.studies.synthetic_sessions import synthetic_session

SCENE: Final = "bench-bumps"
STEPS: Final = (1, 2, 4, 9)
"""Frames from look to look: 90, 45, 22.5 and 10 looks a second."""
BESIDE: Final = {9: "hybrid-qaco"}
"""Step -> the row whose printed time leaves about so many looks a second."""


@dataclass(frozen=True)
class Sampled:
    """What looks at every ``step``-th frame saw of one session."""

    step: int
    # contacts, seconds: that there are
    contacts: int
    seconds: float
    missed: list[int]  # contacts that no look saw, one number for every phase of the looks
    missed_seconds: list[float]  # of contact, in which no contact was believed in, one number for every phase


def sample_frames(seed: int) -> list[Sampled]:
    """One made-up session, looked at with every step of ``STEPS``."""
    assembly = assemble(synthetic_session(SCENE, seed=seed)[0])
    truth = create_detector("continuous", assembly.bodies, pairs=assembly.pairs).detect(assembly.motion)
    contacts = episodes(truth, assembly.motion.valid)
    dwell = contact_durations(assembly, truth, contacts)
    seen = create_detector("exact", assembly.bodies, pairs=assembly.pairs).detect(assembly.motion)
    touching = counts_as_contact(seen.verdict)
    found = []
    for step in STEPS:
        held = [
            held_to(touching, seen.times, (step, phase), [one.pair for one in contacts], dwell.begin, dwell.end)
            for phase in range(step)
        ]
        missed, lost = zip(*held, strict=True)
        found.append(Sampled(step, len(contacts), float(dwell.seconds.sum()), list(missed), list(lost)))
    return found


def held_to(
    touching: BoolArray, times: FloatArray, looks: tuple[int, int], pairs: Sequence[int], begin: FloatArray,
    end: FloatArray,
) -> tuple[int, float]:  # fmt: skip
    """Contacts that no look sees, and seconds of contact in which what the last look saw was none.

    ``touching``: (T, P) what a look at a frame would see.
    ``times``: (T,) seconds.
    ``looks``: frames from look to look, and the first that is looked at.
    ``pairs``, ``begin``, ``end``: (E,) column, and seconds, of every contact.
    """
    step, phase = looks
    frames = np.arange(len(times))
    last = (frames - phase) // step * step + phase
    until = np.append(times[1:], times[-1])
    missed, lost = 0, 0.0
    for pair, first, stop in zip(pairs, begin.tolist(), end.tolist(), strict=True):
        believed = touching[np.maximum(last, 0), pair] & (last >= 0)
        missed += not (believed & (last == frames) & (times >= first) & (times <= stop)).any()
        overlap = np.minimum(until, stop) - np.maximum(times, first)
        lost += float(overlap[(overlap > 0.0) & ~believed].sum())
    return missed, lost


def frame_sampling_table(sessions: Sequence[Sequence[Sampled]]) -> PaperTable:
    """T1d over all sessions."""
    rows: list[tuple[Cell, ...]] = []
    for place, step in enumerate(STEPS):
        some = [one[place] for one in sessions]
        of, seconds = sum(one.contacts for one in some), sum(one.seconds for one in some)
        missed = np.array([one.missed for one in some]).sum(axis=0)
        lost = float(np.array([one.missed_seconds for one in some]).sum(axis=0).mean())
        mean = float(missed.mean())
        interval = wilson(round(mean), of)
        printed = 1e3 * SECONDS[BESIDE[step]] if step in BESIDE else None
        rows.append(
            (HEADSET_HZ / step, of, mean, int(missed.min()), int(missed.max()), mean / of, *interval, seconds, lost,
             lost / seconds, printed)
        )  # fmt: skip
    head = (
        "looks a second", "contacts", "missed, mean", "least", "most", "missed, share", "low", "high",
        "seconds of contact", "missed seconds", "missed seconds, share", f"ms of a detection: {PRINTED}",
    )  # fmt: skip
    note = (
        f"{len(sessions)} x 60 s of {SCENE} at {HEADSET_HZ:g} Hz, half of its contacts planted to last 16 to 24 ms. "
        "Mean, least, and most of all phases of the looks; what a look saw holds until the next. Truth: continuous. "
        "Intervals: Wilson, 95 %, over contacts, not over sampling offsets alone, at the whole number next to the mean."
    )
    return PaperTable("T1d", "Contacts that frame sampling misses", head, tuple(rows), note)

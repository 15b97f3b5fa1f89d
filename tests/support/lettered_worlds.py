"""Worlds with a letter a frame, whose counts are worked out from the letters alone, in every state of an audit."""

from functools import cache
from itertools import groupby

from support.small_worlds import cubes

from replay.engine import compute

FALSE = "% of its contact time is false."
IT = "support.planted_detectors:Scripted (it):"
STATES = {
    # state: (oracle, subject, headline)
    "none": ("......", "nnnnnn", "No contact happened, so none for it to miss, and it reported none."),
    "one": (".CC...", "nnnnnn", f"{IT} 1 of 1 contact missed."),
    "several": ("C.C.CC", "nncncn", f"{IT} 1 of 3 contacts missed, 1 late or cut short."),
    "undecided": (".C.CC.", "nunuun", f"{IT} 2 of 2 contacts undecided."),
    "not measured": ("......", "uuuuuu", "Nothing compared: exact and it decided no pair-frame of 6 together."),
    "more invented than found": ("C.....", "cnccnc", f"{IT} 75 {FALSE}"),
    "false at both ends": ("..CC..C.", "nccccccn", f"{IT} 50 {FALSE}"),
    "more than a list holds": ("C." * 41, "n" * 82, f"{IT} 41 of 41 contacts missed."),
}


@cache
def run(state):
    truth, said, _ = STATES[state]
    places = [0.99 if letter == "C" else 1.01 + 0.02 * (k % 2) for k, letter in enumerate(truth)]
    session = cubes({"a": [0.0] * len(truth), "b": places})
    return compute(session, detectors=f"it=support.planted_detectors:Scripted[says={said}]")


def stretches(letters):
    """First frame, number of frames, and value of each stretch of equal letters."""
    first = 0
    for value, same in groupby(letters):
        count = len(list(same))
        yield first, count, value
        first += count


def became(truth, said):
    """A word for each frame."""
    pairs = {("C", "c"): "both", ("C", "n"): "MISSED", (".", "c"): "false"}
    return ["left out" if mine == "u" else pairs.get((own, mine), "") for own, mine in zip(truth, said, strict=True)]


def missed(truth, said):
    """Contact from 1, first frame and number of frames of each miss."""
    contacts = [(first, count) for first, count, value in stretches(truth) if value == "C"]
    outcome = became(truth, said)
    return len(contacts), [
        (number, begin + first, count)
        for number, (begin, length) in enumerate(contacts, 1)
        for first, count, word in stretches(outcome[begin : begin + length])
        if word == "MISSED"
    ]

"""Worlds with a letter a frame, whose counts are worked out from the letters alone, in every state of an audit."""

from functools import cache
from itertools import groupby

from support.small_worlds import cubes

from replay.pipeline.engine import compute

FALSE = "% of the contact time it reports is false"
STATES = {
    # state: (oracle, subject, headline)
    "none": ("......", "nnnnnn", "No contact found by exact, so none for it to miss"),
    "one": (".CC...", "nnnnnn", "it missed 1 of 1 contact"),
    "several": ("C.C.CC", "nncncn", "it missed 1 of 3 contacts and part of 1 more"),
    "undecided": (".C.CC.", "nunuun", "it left 2 of 2 contacts undecided"),
    "not measured": ("......", "uuuuuu", "Nothing compared: exact and it both decided none of 6 pair-frames"),
    "more invented than found": ("C.....", "cnccnc", f"it: 75 {FALSE}; finds the one contact"),
    "false at both ends": ("..CC..C.", "nccccccn", f"it: 50 {FALSE}; misses none of 2 contacts"),
    "more than a list holds": ("C." * 41, "n" * 82, "it missed 41 of 41 contacts"),
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

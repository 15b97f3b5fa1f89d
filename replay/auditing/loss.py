"""The loss of a detector: one number that orders rankings, tradeoffs, fronts and the dots of every plot.

A detector that samples more often never has a greater loss, as far as its sampling phase is chance: a contact of length
L is missed by samples a time T apart with probability 1 - L/T, and the part of it that is not reported, and the part of
the report that is false, are both T/2L in the mean (1 - L/2T where T > L). Each term falls with the rate, so the sum
does; a count of wrong contacts does not: samples at 2 Hz have few false contacts because they report few at all.
"""

from typing import Final

from replay.auditing.wilson import Proportion

LOSS_MEANING: Final = (
    "share of the contacts missed, plus share of the contact time not reported, plus share of the reported time that "
    "is false: 0 is right, 3 the worst"
)
"""The definition, as every screen prints it."""


def fraction_of(proportion: Proportion | None) -> float:
    """Return a proportion from 0 to 1; 0 of nothing."""
    return 0.0 if proportion is None or proportion.value is None else proportion.value


def lost_contact(
    contacts_missed: Proportion | None, time_missed: Proportion | None, contacts_undecided: float = 0.0
) -> float:
    """The part of a loss that is contact, 0 to 2: contacts that were missed, and contact time that was not reported.

    A missed contact counts in both, so that a tap of a single frame weighs as a contact, and not as a frame.
    ``contacts_undecided``: share of the contacts that the detector left undecided; nobody knows that it found them.
    """
    return fraction_of(contacts_missed) + contacts_undecided + fraction_of(time_missed)


def loss(
    contacts_missed: Proportion | None,
    time_missed: Proportion | None,
    time_false: Proportion | None,
    contacts_undecided: float = 0.0,
) -> float:
    """The loss of a detector, 0 (right) to 3; of a detector of a fixed rate its shares are over 16 sampling offsets.

    Parameters
    ----------
    contacts_missed : of the contacts of the reference, those never reported.
    time_missed : of the pair-frames of these contacts, those not reported.
    time_false : of the pair-frames that the detector reports as contact, those that are none.
    contacts_undecided : as for ``lost``.
    """
    return lost_contact(contacts_missed, time_missed, contacts_undecided) + fraction_of(time_false)

"""Interrupted contacts of planted motions, and release distances that a second run confirms."""

import msgspec
import numpy as np
import pytest
from rich.console import Console
from support.small_worlds import unit_cubes_on_x

from cdcore import Verdict
from cdcore.protocol import counts_as_contact
from replay.auditing.flicker import interruptions_of
from replay.cli.run_markdown import run_markdown
from replay.cli.run_tables import run_screen
from replay.detection.release_band import ReleaseBand
from replay.document.headline import flicker_notes
from replay.document.run_document import RunDocument
from replay.engine import compute
from replay.errors import DetectorSpecError
from replay.show.report.page import report_html
from replay.show.rerun_log.documents import answer_text

DEEP, CLEAR = -0.0002, 0.05
"""Metres between the cubes while they touch, and far from each other."""

BOUNCES = [CLEAR] * 20 + [DEEP, DEEP, 0.0003, DEEP, 0.00046, 0.0001, DEEP, 0.0002, DEEP] + [CLEAR] * 20
"""One contact, interrupted three times by half a millimetre."""


def cubes_at_gaps(metres, **more):
    """Unit cubes so many metres apart in each frame."""
    return unit_cubes_on_x({"a": [0.0] * len(metres), "b": [1.0 + gap for gap in metres]}, **more)


def flicker(session, label="exact", **settings):
    """The interrupted contacts of a detector, and the whole run."""
    result = compute(session, **{"detectors": "exact,mesh=discrete", "oracle": "exact"} | settings)
    return result.document.detectors[label].flicker, result


def test_bounces_within_half_a_millimetre_count_as_one_contact():
    """Release at 0.5 mm counts the four frames between the bounces as contact, 4 of 9 frames: 44 % false contact."""
    counted, result = flicker(cubes_at_gaps(BOUNCES))
    assert (counted.reported, counted.contacts, counted.joined, counted.interruptions) == (4, 4, 1, 3)
    assert counted.widest == pytest.approx(0.00046)
    release = counted.release
    assert (release.metres, release.contacts, release.interruptions) == (0.0005, 1, 0)
    assert (release.false_contact_without, release.false_contact) == (0.0, pytest.approx(4 / 9))
    assert flicker_notes(result)[0] == (
        "Flicker: 4 of 4 contacts of exact are 1 contact, interrupted 3 times for at most 100 ms and 0.46 mm each. "
        "Contact on at 0 mm and off at 0.5 mm joins 3 of 3 interruptions: 44 % false contact instead of 0 % (measured "
        "on this session as exact[release_m=0.0005])."
    )


@pytest.mark.parametrize(
    ("frames_away", "metres", "flickers"),
    [
        (1, 0.0049, True),
        (10, 0.0049, True),
        (11, 0.0049, False),
        (1, 0.0051, False),
        (5, 0.02, False),
        (30, 1.0, False),
    ],
)
def test_body_that_leaves_far_or_long_does_not_flicker(frames_away, metres, flickers):
    """Up to ten frames (100 ms) and 5 mm away, two contacts are joined."""
    counted, result = flicker(cubes_at_gaps([CLEAR, DEEP, DEEP, *[metres] * frames_away, DEEP, DEEP, CLEAR]))
    assert (counted is not None) == flickers == bool(flicker_notes(result))
    if flickers:
        assert (counted.contacts, counted.joined, counted.release.metres) == (2, 1, 0.005)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_tracker_jitter_is_joined_as_by_a_plain_loop(seed):
    """Gaps scatter by 0.14 mm about a touch; the release distance is the largest of them, rounded up to 0.1 mm."""
    noise = np.random.default_rng(seed).normal(0.0, 0.00014, 120)
    metres = [*[CLEAR] * 3, *noise.tolist(), *[CLEAR] * 3]
    counted, _ = flicker(cubes_at_gaps(metres))
    touching, lasting, contacts, joined = False, False, 0, 0
    for gap in metres:
        contacts += gap <= 0.0 and not touching
        touching = gap <= 0.0
        begins = touching and not lasting
        lasting = touching or (lasting and gap <= counted.release.metres)
        joined += begins
    assert counted.reported == contacts > 10
    assert counted.release.contacts == joined < contacts
    within = noise[noise < 0.005]
    assert counted.release.metres == pytest.approx(np.ceil(1e4 * max(within)) / 1e4)


@pytest.mark.slow
@pytest.mark.parametrize("detector", ["mesh=discrete[rate_hz=40]", "mesh=collider[skin_m=0.00005]"])
def test_proposed_release_distance_has_the_predicted_effect(detector):
    """Gaps of 0.1 mm, with 0.2 mm of noise, flicker; the proposal of the first run is the detector of the second."""
    noise = np.random.default_rng(1).normal(0.0001, 0.0002, 120)
    session = cubes_at_gaps([*[CLEAR] * 3, *noise.tolist(), *[CLEAR] * 3])
    counted, first = flicker(session, "mesh", detectors=f"exact,{detector}")
    again, second = flicker(session, "mesh", detectors=f"exact,mesh={counted.release.setting}")
    without, with_release = (
        next(rank for rank in result.ranking if rank.label == "mesh") for result in (first, second)
    )
    assert without.false.value == counted.release.false_contact_without
    assert with_release.false.value == counted.release.false_contact
    assert second.document.detectors["mesh"].contacts == counted.release.contacts < counted.reported
    assert (0 if again is None else again.interruptions) == counted.release.interruptions
    assert "off at" in with_release.what
    assert second.document.detectors["mesh"].release == counted.release.metres


def test_false_contact_within_a_release_distance_has_that_cause():
    """BOUNCES has gaps of up to 0.46 mm, so a release distance of 0.5 mm keeps the contact in them."""
    result = compute(cubes_at_gaps(BOUNCES), detectors="held=discrete[release_m=0.0005]", oracle="exact")
    assert {fault.cause.value for fault in result.false["held"]} == {"within its release distance"}
    assert result.false["held"][0].why.endswith(
        "a contact lasts until the shapes are farther apart than its release distance."
    )
    assert result.answers[0].fix.text.startswith("No release distance")


@pytest.mark.parametrize("seed", range(5))
def test_band_prolongs_as_a_plain_loop_does(seed):
    """Random verdicts of three pairs in 60 frames; ``near``: within the release distance."""
    rng = np.random.default_rng(seed)
    verdict = rng.choice(
        np.array([Verdict.CLEAR, Verdict.CONTACT, Verdict.NO_POSE, Verdict.UNRESOLVED, Verdict.NOT_FOUND], np.uint8),
        (60, 3),
        p=[0.5, 0.15, 0.1, 0.05, 0.2],
    )
    near, sampled = rng.random((60, 3)) < 0.7, rng.random(60) < 0.8
    lasting = ReleaseBand(near).prolonged_verdicts(verdict[sampled], sampled)
    expected = verdict[sampled].copy()
    for column in range(3):
        on = False
        for row, frame in enumerate(np.flatnonzero(sampled).tolist()):
            own = Verdict(verdict[frame, column])
            if own == Verdict.NO_POSE:
                continue
            parted = own in (Verdict.CLEAR, Verdict.NOT_FOUND)
            on = own == Verdict.CONTACT or (on and parted and near[frame, column])
            if on and parted:
                expected[row, column] = Verdict.CONTACT
    assert np.array_equal(lasting, expected)
    assert (counts_as_contact(lasting) != counts_as_contact(verdict[sampled])).any()


def test_contact_of_another_pair_is_no_flicker_interruption():
    """a and b touch in frame 0, c and d in frame 2."""
    session = unit_cubes_on_x({"a": [0.0] * 5, "b": [0.9, 3, 3, 3, 3], "c": [20.0] * 5, "d": [23, 23, 20.95, 23, 23]})
    result = compute(session, detectors="exact", oracle="none")
    contacts = result.episodes["exact"]
    assert [result.assembly.pair_name(contact.pair) for contact in contacts] == ["a-b", "c-d"]
    assert interruptions_of(contacts) == []


def test_flicker_sentence_is_the_same_on_every_screen():
    """The terminal, Markdown, the report and the picture have it word by word; JSON brings the same figures back."""
    _, result = flicker(cubes_at_gaps(BOUNCES))
    (sentence, *_) = flicker_notes(result)
    document = msgspec.json.decode(msgspec.json.encode(result.document), type=RunDocument)
    assert document.detectors["exact"].flicker == result.document.detectors["exact"].flicker
    console = Console(width=200)
    with console.capture() as captured:
        console.print(run_screen(result))
    pages = {
        "terminal": " ".join(captured.get().split()),
        "markdown": run_markdown(result, []).replace("\\", ""),
        "report": report_html(result),
        "picture": answer_text(result),
    }
    assert [name for name, page in pages.items() if sentence not in page] == []


def test_reference_takes_no_release_distance():
    """The reference is exact with a release distance of 1 mm."""
    with pytest.raises(DetectorSpecError, match="the reference has no release distance"):
        compute(cubes_at_gaps(BOUNCES), detectors="mesh=discrete", oracle="exact[release_m=0.001]")


@pytest.mark.parametrize(
    "metres",
    [
        pytest.param("-1", id="negative"),
        pytest.param("2", id="more than a metre"),
        pytest.param("true", id="no number"),
        pytest.param("nan", id="not finite"),
        pytest.param("abc", id="a word"),
    ],
)
def test_release_distance_outside_0_to_1_metre_is_refused(metres):
    """``metres``: as text, behind release_m= in a detector's settings."""
    with pytest.raises(DetectorSpecError, match="release_m="):
        compute(cubes_at_gaps(BOUNCES), detectors=f"discrete[release_m={metres}]")

"""Interrupted contacts of planted motions, and release distances that a second run confirms."""

import msgspec
import numpy as np
import pytest
from rich.console import Console
from support.small_worlds import unit_cubes_on_x

from cdcore import Verdict
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

DEEP = -0.0002
"""Metres of gap between the cubes while they touch: 0.2 mm deep in each other."""

FAR = 0.05
"""Metres of gap between the cubes far from each other."""

BOUNCES = [FAR] * 20 + [DEEP, DEEP, 0.0003, DEEP, 0.00046, 0.0001, DEEP, 0.0002, DEEP] + [FAR] * 20
"""Metres of gap, frame by frame of 10 ms: one contact of nine frames, four of them gaps of up to 0.46 mm.

The gaps interrupt it three times: by one, two and one frames.
"""


def cubes_at_gaps(metres, **more):
    """Unit cubes so many metres apart in each frame."""
    return unit_cubes_on_x({"a": [0.0] * len(metres), "b": [1.0 + gap for gap in metres]}, **more)


def flicker(session, label="exact", **settings):
    """Counts of the interrupted contacts of a detector, and the whole run."""
    result = compute(session, **{"detectors": "exact,mesh=discrete", "oracle": "exact"} | settings)
    return result.document.detectors[label].flicker, result


@pytest.fixture(scope="module")
def bouncing():
    """Counts of the interrupted contacts of a cube that bounces on another (BOUNCES), and the whole run."""
    return flicker(cubes_at_gaps(BOUNCES))


def test_bounces_within_half_a_millimetre_count_as_one_contact(bouncing):
    """A cube bounces on another (BOUNCES): four contacts, which are one, interrupted three times by at most 0.46 mm.

    A contact that lasts up to a gap of 0.5 mm ("release") joins them: 4 of its 9 frames are false, 44 %. The note of
    the run says the same; 100 ms is the longest interruption that counts, those here are of 10 and 20 ms.
    """
    counted, result = bouncing
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
        pytest.param(1, 0.0049, True, id="a frame, 4.9 mm"),
        pytest.param(10, 0.0049, True, id="ten frames, 4.9 mm"),
        pytest.param(11, 0.0049, False, id="eleven frames"),
        pytest.param(1, 0.0051, False, id="5.1 mm"),
    ],
)
def test_body_that_leaves_far_or_long_does_not_flicker(frames_away, metres, flickers):
    """Two contacts of two frames; between them the cube is ``metres`` away for ``frames_away`` frames of 10 ms.

    Up to ten frames (100 ms) and 5 mm away, they are one contact that flickers, joined by a release distance of 5 mm.
    """
    counted, result = flicker(cubes_at_gaps([FAR, DEEP, DEEP, *[metres] * frames_away, DEEP, DEEP, FAR]))
    assert (counted is not None) == flickers == bool(flicker_notes(result))
    if flickers:
        assert (counted.contacts, counted.joined, counted.release.metres) == (2, 1, 0.005)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_tracker_jitter_is_joined_as_by_a_plain_loop(seed):
    """120 gaps scatter by 0.14 mm about a touch: a loop counts contacts, without and with a release distance.

    A contact begins at a gap of 0 and lasts up to the release distance, which is the largest of the gaps, rounded up to
    0.1 mm. There are more than ten contacts without it.
    """
    noise = np.random.default_rng(seed).normal(0.0, 0.00014, 120)
    metres = [*[FAR] * 3, *noise.tolist(), *[FAR] * 3]
    counted, _ = flicker(cubes_at_gaps(metres))
    assert counted.release.metres == pytest.approx(np.ceil(1e4 * max(noise)) / 1e4)
    was_touching, is_lasting, contacts, joined_contacts = False, False, 0, 0
    for gap in metres:
        is_touching = gap <= 0.0
        contacts += is_touching and not was_touching
        joined_contacts += is_touching and not is_lasting
        is_lasting = is_touching or (is_lasting and gap <= counted.release.metres)
        was_touching = is_touching
    assert counted.reported == contacts > 10
    assert counted.release.contacts == joined_contacts < contacts


@pytest.mark.slow
@pytest.mark.parametrize(
    "detector",
    [
        pytest.param("mesh=discrete[rate_hz=40]", id="samples at 40 Hz"),
        pytest.param("mesh=collider[skin_m=0.00005]", id="a skin of 0.05 mm"),
    ],
)
def test_proposed_release_distance_has_the_predicted_effect(detector):
    """120 gaps of 0.1 mm, with 0.2 mm of noise, flicker; a first run proposes a release distance and predicts figures.

    The second run is of the detector with that distance: false contact, contacts and interruptions are as predicted,
    and its row says that contact is "off at" that distance.
    """
    noise = np.random.default_rng(1).normal(0.0001, 0.0002, 120)
    session = cubes_at_gaps([*[FAR] * 3, *noise.tolist(), *[FAR] * 3])
    counted, first = flicker(session, "mesh", detectors=f"exact,{detector}")
    predicted = counted.release
    counted_again, second = flicker(session, "mesh", detectors=f"exact,mesh={predicted.setting}")
    without_release, with_release = (
        next(rank for rank in result.ranking if rank.label == "mesh") for result in (first, second)
    )
    assert without_release.false.value == predicted.false_contact_without
    assert with_release.false.value == predicted.false_contact
    measured = second.document.detectors["mesh"]
    assert measured.release == predicted.metres
    assert measured.contacts == predicted.contacts < counted.reported
    assert (0 if counted_again is None else counted_again.interruptions) == predicted.interruptions
    assert "off at" in with_release.what


def test_false_contact_within_a_release_distance_has_that_cause():
    """A cube bounces with gaps of up to 0.46 mm; a contact that lasts up to 0.5 mm ("release") lasts in them too.

    That is the cause of all false contact, each sentence says so, and the fix is to take the distance away.
    """
    result = compute(cubes_at_gaps(BOUNCES), detectors="lasting=discrete[release_m=0.0005]", oracle="exact")
    false_contacts = result.false["lasting"]
    assert {fault.cause.value for fault in false_contacts} == {"within its release distance"}
    for fault in false_contacts:
        assert fault.why.endswith("a contact lasts until the shapes are farther apart than its release distance.")
    assert result.answers[0].fix.text.startswith("No release distance")


@pytest.mark.parametrize("seed", range(5))
def test_band_prolongs_as_a_plain_loop_does(seed):
    """Random verdicts of three pairs in 60 frames, four in five of which are sampled; ``near``: within the distance.

    A contact lasts through clear samples while they are near. A lost pose changes nothing; any other answer ends it.
    """
    rng = np.random.default_rng(seed)
    verdict = rng.choice(
        np.array([Verdict.CLEAR, Verdict.CONTACT, Verdict.NO_POSE, Verdict.UNRESOLVED, Verdict.NOT_FOUND], np.uint8),
        (60, 3),
        p=[0.5, 0.15, 0.1, 0.05, 0.2],
    )
    near, sampled = rng.random((60, 3)) < 0.7, rng.random(60) < 0.8
    prolonged = ReleaseBand(near).prolonged_verdicts(verdict[sampled], sampled)
    expected = verdict[sampled].copy()
    for pair in range(3):
        is_lasting = False
        for row, frame in enumerate(np.flatnonzero(sampled).tolist()):
            answer = Verdict(verdict[frame, pair])
            if answer == Verdict.NO_POSE:
                continue
            is_clear = answer in (Verdict.CLEAR, Verdict.NOT_FOUND)
            is_lasting = answer == Verdict.CONTACT or (is_lasting and is_clear and near[frame, pair])
            if is_lasting and is_clear:
                expected[row, pair] = Verdict.CONTACT
    assert np.array_equal(prolonged, expected)
    assert (expected != verdict[sampled]).any(), "some contact was prolonged"


def test_contact_of_another_pair_is_no_flicker_interruption():
    """a and b touch in frame 0, c and d, 20 m away, in frame 2: no contact is interrupted by the pause between them."""
    session = unit_cubes_on_x({"a": [0.0] * 5, "b": [0.9, 3, 3, 3, 3], "c": [20.0] * 5, "d": [23, 23, 20.95, 23, 23]})
    result = compute(session, detectors="exact", oracle="none")
    contacts = result.episodes["exact"]
    assert [result.assembly.pair_name(contact.pair) for contact in contacts] == ["a-b", "c-d"]
    assert interruptions_of(contacts) == []


def test_flicker_sentence_is_the_same_on_every_screen(bouncing):
    """A cube bounces on another: terminal, Markdown, report and viewer have the run's note on it word by word."""
    _, result = bouncing
    (sentence, *_) = flicker_notes(result)
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


def test_json_brings_back_the_figures_of_flicker(bouncing):
    """A cube bounces: the document of the run has figures of interrupted contacts, written as JSON and read again."""
    counted, result = bouncing
    document = msgspec.json.decode(msgspec.json.encode(result.document), type=RunDocument)
    assert counted is not None and document.detectors["exact"].flicker == counted


def test_reference_takes_no_release_distance():
    """A contact of the reference, exact, is to last up to a gap of 1 mm: it would hide the gaps of a bouncing cube."""
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
    """A contact may last until the shapes are so far apart (``release_m``, text here): 0 to 1 m, else it is refused."""
    with pytest.raises(DetectorSpecError, match=r"^release_m=.* is not allowed; give metres from 0 to 1"):
        compute(cubes_at_gaps(BOUNCES), detectors=f"discrete[release_m={metres}]")

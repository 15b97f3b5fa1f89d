"""Points and curves are those of the detection, coloured by the audit."""

import numpy as np

from cdcore import Verdict
from replay.comparison.outcome import Outcome
from replay.outputs.palette import FOUND, MISSED
from replay.outputs.rerun_log import scene
from replay.outputs.rerun_log.recording_file import RecordingClock, packed
from replay.outputs.rerun_log.scene import drawn_contacts

ORACLE, SUBJECT = "hybrid", "22.5Hz"


def test_each_frame_shows_a_point_per_contact_and_none_where_there_is_none(demo, read):
    expected = (demo.detections[ORACLE].verdict == Verdict.CONTACT).sum(axis=1)
    shown = [len(read.at("world/contacts/hybrid", "Points3D:positions", frame)) for frame in range(len(expected))]
    assert shown == expected.tolist()
    assert 0 < sum(expected > 0) < len(expected)


def test_curves_are_the_sections_of_the_detection(demo, read):
    detection = demo.detections[ORACLE]
    for frame, pair in np.argwhere(detection.verdict == Verdict.CONTACT)[::7].tolist():
        strips = np.array(read.at("world/contacts/hybrid/section", "LineStrips3D:strips", frame))
        wanted = np.concatenate(
            [detection.section(frame, p) for p in range(len(detection.pairs)) if len(detection.faces(frame, p))]
        )
        assert strips.shape == wanted.shape
        assert np.allclose(strips, wanted, atol=1e-6), pair


def test_missed_contacts_are_red_and_found_ones_blue(demo, read):
    outcome, verdict = demo.comparisons[SUBJECT].outcome, demo.detections[ORACLE].verdict
    colours = {Outcome.MISSED: packed([MISSED])[0], Outcome.BOTH: packed([FOUND])[0]}
    colours[Outcome.HELD] = colours[Outcome.BOTH]
    seen = set()
    for frame in range(len(verdict)):
        wanted = [colours[Outcome(code)] for code in outcome[frame, verdict[frame] == Verdict.CONTACT].tolist()]
        assert read.at("world/contacts/hybrid", "Points3D:colors", frame) == wanted
        seen.update(wanted)
    assert len(seen) == 2


def test_beyond_the_budget_frames_are_strided_but_misses_stay(demo, monkeypatch):
    detection, comparison = demo.detections[ORACLE], demo.comparisons[SUBJECT]
    clock = RecordingClock.of(demo.assembly)
    sets = detection.face_sets
    missed = comparison.outcome[sets.frame, sets.pair] == Outcome.MISSED
    whole, _ = drawn_contacts(clock, sets, comparison)
    wrong = np.isin(comparison.outcome, (Outcome.MISSED, Outcome.INVENTED)).any(axis=1)
    monkeypatch.setattr(scene, "DRAWN_CONTACTS", int(wrong[sets.frame[whole]].sum()) + 1)
    monkeypatch.setattr(scene, "DRAWN_FACES", 10**9)
    part, _ = drawn_contacts(clock, sets, comparison)
    assert len(part) < len(whole) == len(sets.frame) and missed[part].sum() == missed.sum() > 0

"""Points and curves are those of the detection, coloured by the audit."""

import numpy as np

from cdcore import Verdict
from replay.comparison.outcome import Outcome
from replay.outputs.palette import FOUND, MISSED
from replay.outputs.rerun_log import scene
from replay.outputs.rerun_log.recording_file import RecordingClock, packed
from replay.outputs.rerun_log.scene import drawn_contacts

ORACLE, SUBJECT = "hybrid", "22.5Hz"


def test_curves_are_the_sections_of_the_detection_red_where_missed_and_blue_where_found(demo, read):
    detection, outcome = demo.detections[ORACLE], demo.comparisons[SUBJECT].outcome
    red, blue = packed([MISSED, FOUND]).tolist()
    seen = set()
    for frame in range(len(outcome)):
        strips, colours = [], []
        for pair in np.flatnonzero(detection.verdict[frame] == Verdict.CONTACT).tolist():
            section = detection.section(frame, pair)
            strips += [*section]
            colours += [red if outcome[frame, pair] == Outcome.MISSED else blue] * len(section)
        drawn = read.at("world/contacts/hybrid", "LineStrips3D:strips", frame)
        assert np.allclose(np.reshape(drawn, (-1, 2, 3)), np.reshape(strips, (-1, 2, 3)), atol=1e-6), frame
        assert read.at("world/contacts/hybrid", "LineStrips3D:colors", frame) == colours
        seen.update(colours)
    assert seen == {red, blue}


def test_beyond_the_budget_frames_are_strided_but_moments_stay(demo, monkeypatch):
    sets = demo.detections[ORACLE].face_sets
    moments = [miss.deepest for miss in demo.misses[SUBJECT]]
    clock = RecordingClock.of(demo.assembly, moments)
    assert len(drawn_contacts(clock, sets)[0]) == len(sets.frame)
    monkeypatch.setattr(scene, "DRAWN_CONTACTS", 20)
    part, frames = drawn_contacts(clock, sets)
    assert {*moments} <= {*frames.tolist()} and len(part) < len(sets.frame)
    assert np.isin(sets.frame[part], frames).all()

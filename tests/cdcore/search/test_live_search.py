"""A search asked frame by frame says what it says of the whole motion, and counts what it did."""

from time import perf_counter

import numpy as np
from support.shapes import lab

from cdcore import Verdict, create_detector, detect_live
from cdcore.search.live_search import LiveSearch


def test_looks_find_what_the_whole_motion_finds_and_count_the_same_work():
    bodies, motion = lab(40)
    for settings in ({}, {"budget": 30}, {"sphere": "paper"}):
        detector = create_detector("hybrid-qaco", bodies, **settings)
        assert isinstance(detector.live(), LiveSearch)
        whole, looks = detector.detect(motion), detect_live(detector, motion)
        assert np.array_equal(whole.verdict, looks.verdict)
        assert {Verdict.CONTACT, Verdict.CLEAR} <= set(looks.verdict.ravel().tolist())
        assert looks.work["evaluations"] == whole.work["evaluations"] > 0


def test_the_seconds_of_the_stages_are_within_those_of_the_look():
    bodies, motion = lab(40)
    live = create_detector("hybrid-qaco", bodies).live()
    for frame in range(40):
        start = perf_counter()
        live.look(motion.frames(frame, frame + 1))
        spent = perf_counter() - start
        assert min(live.seconds.values()) >= 0 and sum(live.seconds.values()) <= spent

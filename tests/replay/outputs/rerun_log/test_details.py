"""Details: at every instant without a moment of its own one worked moment is shown, as it stood then."""

import numpy as np

from replay.outputs.moments import key_moments
from replay.outputs.rerun_log.details import worked_moment

SUBJECT = "22.5Hz"


def test_between_moments_bodies_words_and_eye_are_those_of_the_worked_moment(demo, read):
    own = [one for one in key_moments(demo) if one.label == SUBJECT]
    worked = worked_moment(demo, own)
    key = demo.answers[0].moment
    assert (worked.number, worked.frame) == (key.number, key.frame), "that of the sentences"
    root = next(path for path in read.entities if path.startswith("/details/") and path.endswith("/note"))[1:-5]
    inside = {frame for one in own for frame in range(min(one.first, one.frame), one.last + 1)}
    free = [frame for frame in range(len(demo.assembly.motion)) if frame not in inside]
    assert free
    rod = demo.assembly.names.index("rod")
    for frame in (free[0], free[len(free) // 2], free[-1]):
        assert read.at(f"{root}/note", "TextDocument:text", frame) == [worked.said]
        (place,) = read.at(f"{root}/bodies/rod", "Transform3D:translation", frame)
        assert np.allclose(place, demo.assembly.motion.translations[worked.frame, rod], atol=1e-6)
    for one in own:
        ns = int(demo.assembly.stamp_ns[one.frame] - demo.assembly.stamp_ns[0]) + one.later
        assert read.at_ns(f"{root}/note", "TextDocument:text", ns) == [one.said]


def test_counters_and_times_of_stages_are_those_of_the_detection(demo, read):
    for label, detection in demo.detections.items():
        for name, value in detection.work.items():
            path = f"counters/{label}/{name}"
            rows = read.column(path, "Scalars:scalars")
            assert [rows[0][2][0]] == [float(value)] if np.any(value) else rows == []
        total = read.column(f"timing/{label}/total", "Scalars:scalars")
        seconds = list(detection.seconds.values())
        if isinstance(seconds[0], np.ndarray):
            assert np.allclose([row[2][0] for row in total], 1e3 * np.sum(seconds, axis=0))
        else:
            mean = 1e3 * sum(seconds) / len(detection.times)
            assert [row[1] for row in total] == [0, len(detection.times) - 1]
            assert np.allclose([row[2][0] for row in total], mean)

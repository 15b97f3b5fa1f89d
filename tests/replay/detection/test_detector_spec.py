from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.detection.detector_spec import MOST_RELEASE_M, DetectorSpec, parse_detector, parse_detectors
from replay.errors import DetectorSpecError
from replay.settings import usual_detectors
from sessions import Session, Track

SESSION = Session.from_tracks({"cup": Track([0], [[0.0, 0.0, 0.0]], [[0.0, 0.0, 0.0, 1.0]])})


@pytest.mark.parametrize(
    ("text", "label", "name", "settings"),
    [
        ("hybrid", "hybrid", "hybrid", {}),
        (" hybrid ", "hybrid", "hybrid", {}),
        ("discrete[rate_hz=22.5]", "discrete-22.5", "discrete", {"rate_hz": 22.5}),
        ("slow=discrete[rate_hz=22.5]", "slow", "discrete", {"rate_hz": 22.5}),
        ("22.5Hz=discrete[rate_hz=22.5]", "22.5Hz", "discrete", {"rate_hz": 22.5}),
        ("x=hybrid", "x", "hybrid", {}),
        ("hybrid[]", "hybrid", "hybrid", {}),
        (
            "q=hybrid-qaco[ants=20, stop_first=true,variant=local,budget=none]",
            "q",
            "hybrid-qaco",
            {"ants": 20, "stop_first": True, "variant": "local", "budget": None},
        ),
        ("my.package:Class", "Class", "my.package:Class", {}),
        ("hull50", "hull50", "collider", {"shape": "hull", "rate_hz": 50}),
        ("hull", "hull", "collider", {"shape": "hull"}),
        ("hull22.5", "hull22.5", "collider", {"shape": "hull", "rate_hz": 22.5}),
        ("hull50[skin_m=0.01]", "hull50-0.01", "collider", {"shape": "hull", "rate_hz": 50, "skin_m": 0.01}),
        ("hull50[rate_hz=50]", "hull50-50", "collider", {"shape": "hull", "rate_hz": 50}),
        ("shipped50", "shipped50", "collider", {"shape": "shipped", "rate_hz": 50}),
        ("mesh50", "mesh50", "discrete", {"rate_hz": 50}),
        ("mesh", "mesh", "discrete", {}),
        ("x=paper[ants=20]", "x", "hybrid-qaco", {"ants": 20}),
    ],
)
def test_detector_text_is_parsed_to_label_name_and_settings(text, label, name, settings):
    """A text is label=name[setting=value, ...]. Names with a rate, as hull50, stand for a detector with settings.

    A label that is not written is the name, with the values of the settings.
    """
    spec = parse_detector(text)
    assert (spec.label, spec.name, spec.settings) == (label, name, settings)
    assert [type(value) for value in spec.settings.values()] == [type(value) for value in settings.values()]


def test_detectors_given_as_text_list_or_mapping_are_equal():
    """A label before =, settings in brackets; a name without a label is its own."""
    want = (DetectorSpec("slow", "discrete", {"rate_hz": 22.5}), DetectorSpec("hybrid", "hybrid"))
    slow = ("discrete", {"rate_hz": 22.5})
    assert parse_detectors("slow=discrete[rate_hz=22.5],hybrid") == want
    assert parse_detectors(["slow=discrete[rate_hz=22.5]", "hybrid"]) == want
    assert parse_detectors(("slow=discrete[rate_hz=22.5]", "hybrid")) == want
    assert parse_detectors({"slow": slow, "hybrid": "hybrid"}) == want
    assert parse_detectors({"slow": "discrete[rate_hz=22.5]", "hybrid": "other=hybrid"}) == want
    assert parse_detectors([want[0], "hybrid"]) == want
    assert [str(item) for item in parse_detectors("a=x[p=1,q=2],z")] == ["a=x[p=1,q=2]", "z=z"]
    assert parse_detectors(slow) == (DetectorSpec("discrete-22.5", "discrete", {"rate_hz": 22.5}),)
    assert parse_detectors(want[1]) == want[1:]


@pytest.mark.parametrize("text", ["hull50[rate_hz=20]", "hull[shape=box]", "mesh50[rate_hz=none]"])
def test_setting_that_contradicts_name_is_refused(text):
    """hull50 is a hull at 50 Hz, mesh50 a mesh at 50 Hz."""
    with pytest.raises(DetectorSpecError, match="contradicts"):
        parse_detector(text)


@pytest.mark.parametrize("rate", [50.0, 22.5, 89.94, 120, 0.001])
def test_default_lineup_reads_back_from_its_labels(rate):
    """``rate``: steps a second of the engine."""
    lineup = usual_detectors(SESSION, rate)
    assert [parse_detector(spec.label) for spec in lineup] == list(lineup)
    assert lineup[0].settings["rate_hz"] == lineup[1].settings["rate_hz"] == rate


def test_empty_detector_list_is_parsed_as_no_detector():
    assert parse_detectors(()) == () and parse_detectors("") == ()


values = st.one_of(st.none(), st.booleans(), st.integers(), st.floats(allow_nan=False, allow_infinity=False))


labels = st.builds(str.__add__, st.sampled_from("AZaz09"), st.text("Az9._-", max_size=9))


@given(labels, st.dictionaries(st.sampled_from("pqr"), values))
def test_a_spec_written_out_reads_back(label, settings):
    """Random labels of letters and digits, and random values of settings p, q and r."""
    spec = DetectorSpec(label, "discrete", settings)
    assert parse_detector(str(spec)) == spec


@given(st.dictionaries(st.sampled_from("pqr"), st.one_of(values, st.text('a"\\\n\0ä\u202e杯🙂', max_size=5))))
def test_generated_label_is_a_valid_entity_path(settings):
    """A label made of settings is accepted as a label, whatever text they hold; DetectorSpec checks it."""
    label = parse_detector(("discrete", settings)).label
    assert DetectorSpec(label, "x").label == label


@pytest.mark.parametrize("release", [-0.001, 1.01 * MOST_RELEASE_M, inf, nan, True, "0.01", None])
def test_release_distance_is_a_length_within_its_limit(release):
    """Refused are numbers outside 0 to MOST_RELEASE_M, no numbers and other types; both limits are allowed."""
    with pytest.raises(DetectorSpecError, match="is not allowed; give metres from 0 to"):
        DetectorSpec("it", "hybrid", release=release)
    assert [DetectorSpec("it", "hybrid", release=metres).release for metres in (0, MOST_RELEASE_M)] == [
        0,
        MOST_RELEASE_M,
    ]

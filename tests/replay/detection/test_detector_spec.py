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
    """A text is label=name[setting=value, ...]; a label that is not written is the name, with the settings' values.

    Short names stand for a detector with settings: hull50 for convex hulls at 50 Hz, shipped50 for the colliders that
    were recorded, mesh50 for meshes, paper for hybrid-qaco. Values have the type that they look like.
    """
    spec = parse_detector(text)
    assert (spec.label, spec.name, spec.settings) == (label, name, settings)
    assert [type(value) for value in spec.settings.values()] == [type(value) for value in settings.values()]


SLOW, HYBRID = DetectorSpec("slow", "discrete", {"rate_hz": 22.5}), DetectorSpec("hybrid", "hybrid")
"""Two detectors, of which the first has a label of its own and a setting."""


@pytest.mark.parametrize(
    "detectors",
    [
        "slow=discrete[rate_hz=22.5],hybrid",
        ["slow=discrete[rate_hz=22.5]", "hybrid"],
        ("slow=discrete[rate_hz=22.5]", "hybrid"),
        [SLOW, "hybrid"],
        {"slow": ("discrete", {"rate_hz": 22.5}), "hybrid": "hybrid"},
        {"slow": "discrete[rate_hz=22.5]", "hybrid": "other=hybrid"},
    ],
    ids=[
        "text",
        "list of texts",
        "tuple of texts",
        "a spec and a text",
        "name and settings by label",
        "texts by label",
    ],
)
def test_detectors_given_as_text_list_or_mapping_are_equal(detectors):
    """A label stands before =, settings in brackets; a key of a mapping is the label, whatever its text has."""
    assert parse_detectors(detectors) == (SLOW, HYBRID)


def test_a_single_detector_is_parsed_as_a_list_of_it():
    """A spec, or a tuple of name and settings, whose label is made of both."""
    assert parse_detectors(HYBRID) == (HYBRID,)
    named_by_its_setting = DetectorSpec("discrete-22.5", "discrete", {"rate_hz": 22.5})
    assert parse_detectors(("discrete", {"rate_hz": 22.5})) == (named_by_its_setting,)


def test_commas_in_brackets_separate_settings_and_not_detectors():
    """Two detectors as one text; written out, each has its label."""
    assert [str(spec) for spec in parse_detectors("a=x[p=1,q=2],z")] == ["a=x[p=1,q=2]", "z=z"]


@pytest.mark.parametrize("text", ["hull50[rate_hz=20]", "hull[shape=box]", "mesh50[rate_hz=none]"])
def test_setting_that_contradicts_name_is_refused(text):
    """hull50 is a detector of convex hulls at 50 Hz, mesh50 of meshes at 50 Hz."""
    with pytest.raises(DetectorSpecError, match="contradicts"):
        parse_detector(text)


@pytest.mark.parametrize("rate_hz", [50.0, 22.5, 89.94, 120, 0.001])
def test_default_lineup_reads_back_from_its_labels(rate_hz):
    """Default detectors, the first two of which sample at the steps of an engine, ``rate_hz``, have labels as hull50.

    Each label alone is parsed as the same detector.
    """
    hulls, meshes, *others = usual_detectors(SESSION, rate_hz)
    assert [parse_detector(spec.label) for spec in (hulls, meshes, *others)] == [hulls, meshes, *others]
    assert hulls.settings["rate_hz"] == meshes.settings["rate_hz"] == rate_hz


@pytest.mark.parametrize("detectors", [(), ""], ids=["empty tuple", "empty text"])
def test_empty_detector_list_is_parsed_as_no_detector(detectors):
    """An empty list asks for no detector, which is not the same as asking for the default ones."""
    assert parse_detectors(detectors) == ()


values = st.one_of(st.none(), st.booleans(), st.integers(), st.floats(allow_nan=False, allow_infinity=False))


labels = st.builds(str.__add__, st.sampled_from("AZaz09"), st.text("Az9._-", max_size=9))


@given(label=labels, settings=st.dictionaries(st.sampled_from("pqr"), values))
def test_a_spec_written_out_reads_back(label, settings):
    """A detector with a random label of letters and digits, and random values of settings p, q and r."""
    spec = DetectorSpec(label, "discrete", settings)
    assert parse_detector(str(spec)) == spec


@given(settings=st.dictionaries(st.sampled_from("pqr"), st.one_of(values, st.text('a"\\\n\0ä\u202e杯🙂', max_size=5))))
def test_generated_label_is_a_valid_entity_path(settings):
    """A label that is made of settings is accepted as a label, whatever text is in them; DetectorSpec checks it.

    Labels become entity paths in the viewer's file.
    """
    label = parse_detector(("discrete", settings)).label
    assert DetectorSpec(label, "x").label == label


@pytest.mark.parametrize("release", [-0.001, 1.01 * MOST_RELEASE_M, inf, nan, True, "0.01", None])
def test_release_distance_outside_its_limits_is_refused(release):
    """``release``: metres up to which a contact lasts, 0 to 1 (MOST_RELEASE_M); here outside, or no number."""
    with pytest.raises(DetectorSpecError, match="is not allowed; give metres from 0 to"):
        DetectorSpec("it", "hybrid", release=release)


@pytest.mark.parametrize("release", [0, MOST_RELEASE_M])
def test_release_distance_may_be_at_its_limits(release):
    """``release``: metres up to which a contact lasts, 0 to 1 (MOST_RELEASE_M)."""
    assert DetectorSpec("it", "hybrid", release=release).release == release

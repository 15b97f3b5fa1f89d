"""The embedded layout names only what is in the recording, opens on the audit, and stands still."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import rerun.blueprint as rrb
from rerun.chunk import RrdReader

from cdcore import Motion
from replay.outputs.camera import Eye
from replay.outputs.rerun_log import blueprint
from replay.outputs.rerun_log.layout import LANES_IN_VIEW, BlueprintInput, Subject, lanes_in_view
from replay.outputs.rerun_log.overview import read_moments
from replay.outputs.rerun_log.recording import write_recording
from replay.outputs.rerun_log.timing import cost_of, timing_view
from replay.outputs.rerun_log.views import faded_meshes


class Layout:
    """The blueprint as the file holds it: entity -> component -> values."""

    def __init__(self, path):
        reader = RrdReader(path)
        self.stores = reader.blueprints()
        self.values = {}
        for chunk in reader.stream(store=self.stores[0]).to_chunks():
            batch = chunk.to_record_batch()
            for name in batch.schema.names:
                if ":" in name:
                    self.values.setdefault(chunk.entity_path, {})[name] = batch.column(name).to_pylist()[-1]

    def views(self):
        """Name of each view -> its query, with ``$origin`` written out."""
        found = {}
        for entity, values in self.values.items():
            if "ViewBlueprint:display_name" in values:
                origin = values["ViewBlueprint:space_origin"][0]
                query = self.values[f"{entity}/ViewContents"]["ViewContents:query"]
                found[values["ViewBlueprint:display_name"][0]] = [line.replace("$origin", origin) for line in query]
        return found


@pytest.fixture(scope="module")
def layout(recording):
    return Layout(recording)


def selected(query, entities):
    """Entities of a query; a later and more exact rule wins, as in the viewer."""
    chosen = []
    for entity in entities:
        rules = [
            (len(path), line.startswith("-"))
            for line in query
            for path in [line.lstrip("+- ")]
            if entity == path or (path.endswith("/**") and (entity + "/").startswith(path[:-2]))
        ]
        if rules and not max(rules)[1]:
            chosen.append(entity)
    return chosen


def test_there_is_one_layout_and_it_has_a_tab_per_question(layout):
    assert len(layout.stores) == 1
    names = {v.get("ContainerBlueprint:display_name", [""])[0]: v for v in layout.values.values()}
    assert set(names) - {""} == {"Answer", "Audit", "What accuracy costs", "Detectors"}
    lanes = len(layout.views()["When    red numbers: misses"])
    shares = names["Answer"]["ContainerBlueprint:row_shares"]
    assert shares[1:] == pytest.approx([(64 + 40 * lanes) / 704, 0.235]) and sum(shares) == pytest.approx(1.0)


def test_every_view_shows_something_and_all_of_it_has_rows_where_the_cursor_goes(layout, recording, read):
    place = next(one for one in read_moments(recording) if one.kind == "miss")
    entities = [entity for entity in read.entities if not entity.startswith("/__")]
    for name, query in layout.views().items():
        shown = selected(query, entities)
        assert shown, name
        for entity in shown:
            batches = read.entities[entity]
            starts = [
                b.column("session").cast("int64").to_pylist() if "session" in b.schema.names else [-1] for b in batches
            ]
            assert min(min(rows) for rows in starts) <= place.session_ns, entity


def test_exact_paths_of_the_layout_are_in_the_recording(layout, read):
    lines = [
        line for query in layout.views().values() for line in query if not line.startswith("-") and "*" not in line
    ]
    assert len(lines) > 5
    assert not [line for line in lines if line not in read.entities]


def test_the_viewer_opens_paused_slow_and_on_the_session_timeline(layout):
    panel = layout.values["/time_panel"]
    assert panel["TimePanelBlueprint:timeline"] == ["session"]
    assert panel["TimePanelBlueprint:playback_speed"] == [0.25]
    assert panel["TimePanelBlueprint:play_state"] == [1]
    assert layout.values["/selection_panel"]["PanelBlueprint:state"] == [1]
    assert layout.values["/blueprint_panel"]["PanelBlueprint:state"] == [1]


def test_the_headline_is_the_title_of_the_list(layout):
    assert any("22.5Hz missed " in name for name in layout.views())


def test_the_close_up_follows_the_camera_in_the_data(layout, read):
    tracked = [
        v["EyeControls3D:tracking_entity"] for v in layout.values.values() if "EyeControls3D:tracking_entity" in v
    ]
    assert sorted(tracked) == [["/world/focus/eye"], ["/world/missed/eye"]]
    assert {path for (path,) in tracked} <= set(read.entities)


def test_lanes_in_view_fit_the_screen(layout):
    lanes = next(query for name, query in layout.views().items() if name.startswith("When"))
    assert 2 <= len(lanes) <= LANES_IN_VIEW


def test_the_number_lane_is_left_out_of_the_zoomed_view(layout):
    near = next(query for name, query in layout.views().items() if "around the cursor" in name)
    assert "/lanes/1_missed" not in near
    assert near


@pytest.mark.parametrize(("share", "drawn"), [(0.1, False), (0.9, True), (3.0, True)])
def test_the_budget_line_is_drawn_where_it_does_not_press_the_curves_down(demo, tmp_path, share, drawn):
    slow = demo.detections["22.5Hz"]
    timed = replace(slow, seconds={"meshes": np.full(270, share / 90.0)})
    write_recording(replace(demo, detections={**demo.detections, "22.5Hz": timed}), tmp_path / "run.rrd")
    views = Layout(tmp_path / "run.rrd").views().items()
    views = [(name, query) for name, query in views if name.startswith("Time per frame,")]
    assert len(views) == 2
    for name, query in views:
        assert ("/timing/budget" in query) == drawn
        assert f"worst {share * 1e3 / 90:.2f}: {100 * share:.0f} % of a " in name and "90 Hz" in name


def test_what_hides_a_contact_is_translucent_in_the_close_up_and_the_ground_is_not(demo):
    own = demo.assembly.motion
    always = Motion(own.times, own.translations, own.rotations, np.ones_like(own.valid))
    run = replace(demo, assembly=replace(demo.assembly, motion=always))
    faded = faded_meshes(run, ["rod", "bench", "beaker"])
    alpha = {path: one.albedo_factor.as_arrow_array().to_pylist()[0] & 255 for path, one in faded.items()}
    assert alpha == {"/world/rod/mesh": 110, "/world/beaker/mesh": 34}
    assert "/world/hand/mesh" not in faded_meshes(demo, ["hand"]), "its colour hides it where it has no pose"


def test_one_look_that_the_machine_held_up_is_cut_off_and_the_title_says_so(demo, tmp_path):
    slow = demo.detections["22.5Hz"]
    seconds = np.full(2000, 0.001)
    seconds[7] = 0.05
    costs = {"it": cost_of(replace(slow, seconds={"meshes": seconds}))}
    view = timing_view(costs, rrb.TimeAxis(), short=True)
    assert "worst 50.00, cut off: 450 % of a 90 Hz frame" in view.name


@pytest.mark.slow
def test_hundreds_of_misses_are_listed_by_clusters_first_and_each_in_a_tab_beside(hundreds, layout):
    views = Layout(hundreds[1].path).views()
    (first,) = [query for name, query in views.items() if re.match(r"22\.5Hz missed \d+ of \d+", name)]
    assert any("/report/clusters" in line for line in first) and any("/report/missed" in line for line in views["All"])
    assert "All" not in layout.views(), "a dozen misses need no clusters"


def built(subjects, effects, *, tradeoff=False):
    """The tabs of a layout made by hand."""
    room = SimpleNamespace(scene=SimpleNamespace(name="room"), intervals=(), facts={})
    moving = SimpleNamespace(valid=np.ones((1, 0), dtype=bool), times=np.zeros(0))
    result = SimpleNamespace(
        tradeoff=tradeoff or None,
        noise=None,
        detections={},
        detectors={},
        misses={},
        effects=effects,
        treatment=None,
        session=room,
        assembly=SimpleNamespace(names=(), motion=moving, stamp_ns=np.zeros(0, dtype=np.int64)),
        comparisons={"slow": SimpleNamespace(counts=np.array([1]))},
    )
    eye = Eye((1.0, 1.0, 1.0), (0.0, 0.0, 0.0))
    layout = BlueprintInput(result, subjects, eye, detector_lanes=False)
    return blueprint.build_blueprint(layout).root_container


def effect(units="", lanes=0):
    """One effect with a series of each unit and so many lanes."""
    series = {unit: SimpleNamespace(unit=unit) for unit in units}
    output = SimpleNamespace(lanes={f"l{k}": () for k in range(lanes)})
    return {"heat": SimpleNamespace(series=series, output=output, events=())}


@pytest.mark.parametrize(
    ("tradeoff", "effects", "audited", "opens"),
    [
        (True, True, True, "What accuracy costs"), (False, True, True, "Audit"), (False, True, False, "Effects"),
        (False, False, False, "Session"),
    ],
)  # fmt: skip
def test_the_picture_opens_on_the_tab_that_answers_what_was_asked_for(tradeoff, effects, audited, opens):
    subject = Subject("slow", "1 missed", {"lanes/1_missed": None}, None, "a", False, "b", "c")
    tabs = built((subject,) if audited else (), effect() if effects else {}, tradeoff=tradeoff)
    names = [str(one.name) for one in tabs.contents]
    assert names[int(tabs.active_tab)] == opens, names


@pytest.mark.parametrize(("lanes", "high"), [(6, 64 + 6 * 40), (30, 0.6 * 704)])
def test_lanes_of_effects_have_the_height_they_need_and_plots_share_what_is_left(lanes, high):
    tab = next(one for one in built((), effect("abc", lanes)).contents if one.name == "Effects")
    assert tab.contents[1].row_shares == pytest.approx([high, *[(704 - high) / 3] * 3])


LANES = {"lanes/1_missed": None, **{f"lanes/{k}_p": k for k in range(2, 14)}}


def subject(longest):
    return Subject("slow", "1 of 2 missed", LANES, longest, "", False, "", "")


@pytest.mark.parametrize("longest", [None, 2, LANES_IN_VIEW])
def test_the_worst_lanes_are_in_view(longest):
    assert lanes_in_view(subject(longest)) == list(LANES)[:LANES_IN_VIEW]


@pytest.mark.parametrize("longest", [LANES_IN_VIEW + 1, 13])
def test_the_lane_of_the_longest_cut_takes_the_place_of_the_least_bad_one(longest):
    assert lanes_in_view(subject(longest)) == [*list(LANES)[: LANES_IN_VIEW - 1], f"lanes/{longest}_p"]


@pytest.mark.parametrize("longest", [None, 2, 13])
def test_what_noise_leaves_stands_below_half_as_many_pairs(longest):
    pairs = {None: (2, 3), 2: (2, 3), 13: (2, 13)}[longest]
    below = [path for k in pairs for path in (f"lanes/{k}_p", f"lanes/{k}_p/in_noise")]
    assert lanes_in_view(subject(longest), noisy=True) == ["lanes/1_missed", *below]

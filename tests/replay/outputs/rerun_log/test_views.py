"""Five tabs at most; none opens empty, wherever the cursor stands, and the layout names only what is recorded."""

from dataclasses import replace

import numpy as np
import pytest
from rerun.chunk import RrdReader

from replay.effects.effects_runner import EffectRun
from replay.effects.output import EffectEvent, EffectOutput
from replay.effects.protocol import EffectSpec
from replay.outputs.rerun_log.moments import read_moments
from replay.pipeline.engine import compute
from replay.studies.synthetic_sessions import synthetic_session

OVER_TIME = {"TimeSeries", "StateTimeline", "TextLog"}
"""Classes of views that show rows of all times; any other shows what is latest at the cursor."""

DRAWN = ("positions", "strips", "vertex_positions", "half_sizes", "scalars", "state", "text", "translation")
"""Components without which nothing is seen."""


class Layout:
    """The blueprint as the file holds it: entity -> component -> values."""

    def __init__(self, path):
        reader = RrdReader(path)
        self.values = {}
        for chunk in reader.stream(store=reader.blueprints()[0]).to_chunks():
            batch = chunk.to_record_batch()
            for name in batch.schema.names:
                if ":" in name:
                    self.values.setdefault(chunk.entity_path, {})[name] = batch.column(name).to_pylist()[-1]

    def views(self):
        """(name, class, query) of every view, with ``$origin`` written out."""
        for entity, values in self.values.items():
            if "ViewBlueprint:display_name" in values:
                origin = values["ViewBlueprint:space_origin"][0]
                query = self.values[f"{entity}/ViewContents"]["ViewContents:query"]
                lines = [line.replace("$origin", origin) for line in query]
                yield values["ViewBlueprint:display_name"][0], values["ViewBlueprint:class_identifier"][0], lines

    def tabs(self):
        """Names of the tabs, from left to right."""
        (root,) = self.values["/viewport"]["ViewportBlueprint:root_container"]
        contents = self.values[f"/container/{uuid(root)}"]["ContainerBlueprint:contents"]
        return [self.values[f"/{path}"]["ContainerBlueprint:display_name"][0] for path in contents]


def uuid(number):
    text = bytes(number).hex() if isinstance(number, list | bytes) else f"{number:032x}"
    return "-".join((text[:8], text[8:12], text[12:16], text[16:20], text[20:]))


@pytest.fixture(scope="module")
def searched(searching, drawn):
    """The picture of a run with a search, read back."""
    return drawn(searching)


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


def drawn(read, entity, kind, ns):
    """How many values that can be seen an entity has at the cursor, or ever in a view of all times."""
    names = {name for batch in read.entities[entity] for name in batch.schema.names if name.endswith(DRAWN)}
    found = 0
    for name in names:
        rows = read.column(entity.removeprefix("/"), name)
        if kind not in OVER_TIME:
            rows = [row for row in rows if row[0] is None or row[0] <= ns][-1:]
        found += sum(len(row[2]) for row in rows)
    return found


def empty_views(read, share):
    """Names of views with nothing to see at a share of the session, or (``None``) where the picture opens."""
    places = read_moments(read.path)
    last = max((one.session_ns for one in places), default=0)
    leading = next((one.session_ns for one in places if one.leads), 0)
    ns = leading if share is None else int(share * last)
    entities = [entity for entity in read.entities if not entity.startswith("/__")]
    return [
        name
        for name, kind, query in Layout(read.path).views()
        if not sum(drawn(read, entity, kind, ns) for entity in selected(query, entities))
    ]


@pytest.mark.parametrize("share", [0.0, 0.31, 1.0, None])
def test_no_view_is_empty_at_any_cursor(searched, share):
    assert len([*Layout(searched.path).views()]) > 12
    assert empty_views(searched, share) == []


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["titration", "ammonia-calorimetry", "flame-test"])
def test_no_view_of_a_run_with_effects_opens_empty(scene, drawn):
    session, _ = synthetic_session(scene, 0, None)
    read = drawn(compute(session, detectors="discrete[rate_hz=22.5]"))
    assert "Effects" in Layout(read.path).tabs() and empty_views(read, None) == []
    assert sum(one.leads for one in read_moments(read.path)) == 1, "a moment of the audit, or the result"


def test_effects_are_seen_from_where_their_events_are_with_their_marks_and_open_on_what_happened(demo, drawn):
    event = EffectEvent(
        1.0, "spill", ("beaker", "bench"), message="3 mL beside", level="warning", point=(0.0, 0.1, 0.0)
    )
    output = EffectOutput(events=(event,))
    spill = EffectRun(EffectSpec("pour", "x", lambda _: output), ("declared",), output, 0.1, {}, 3, 2)
    read = drawn(replace(demo, effects={"pour": spill}))
    layout = Layout(read.path)
    assert empty_views(read, None) == [] and "/happened" in read.entities
    assert "Effects" in layout.tabs()
    (query,) = (query for name, kind, query in layout.views() if "/world/effects/**" in query)
    assert "/world/effects/pour/1" in selected(query, read.entities)
    eyes = [values for values in layout.values.values() if "EyeControls3D:position" in values]
    seen = [np.subtract(values["EyeControls3D:look_target"][0], (0.0, 0.02, 0.0)) for values in eyes]
    assert min(np.linalg.norm(away) for away in seen) < 0.02, "the beaker; a bench holds the room"


def test_the_tabs_of_an_audit_are_questions(searched, recording):
    assert Layout(searched.path).tabs() == ["Answer", "Pipeline", "Accuracy against cost", "Details"]
    assert Layout(recording).tabs() == ["Answer", "Accuracy against cost", "Details"], "no search, no pipeline"


def test_exact_paths_of_the_layout_and_eyes_that_it_follows_are_in_the_recording(searched):
    layout = Layout(searched.path)
    exact = [line for _, _, query in layout.views() for line in query if not line.startswith("-") and "*" not in line]
    tracked = [path for values in layout.values.values() for path in values.get("EyeControls3D:tracking_entity", ())]
    assert len(exact) > 5 and len(tracked) == 4
    assert not [path for path in [*exact, *tracked] if path not in searched.entities]

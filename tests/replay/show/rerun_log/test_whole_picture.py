"""Pictures, whole: the layout from the first tab to the last, and what every entity shows when; no view opens empty."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from rerun.chunk import RrdReader
from support.report_states import run_with_steady_times, with_steady_times

from replay.effects.effects_runner import SKIPPED_LANE, EffectRun
from replay.effects.output import EffectEvent, EffectOutput, LaneSpan, Liquid, Series
from replay.effects.protocol import EffectSpec
from replay.engine import compute
from replay.show.rerun_log.moments import read_bookmarks
from replay.studies.synthetic_sessions import synthetic_session
from sessions import Interval

TIMES = np.array([0.0, 0.5, 1.0])
POUR = EffectOutput(
    events=(
        EffectEvent(0.25, "pours", ("rod",)),
        EffectEvent(0.5, "spill", ("beaker", "bench"), message="3 mL beside", level="warning", point=(0.0, 0.1, 0.0)),
    ),
    series={"beaker/volume": Series(TIMES, np.array([3.0, 2.0, np.nan]), "mL")},
    lanes={
        "rod": (LaneSpan(start=0.0, end=0.5, word="pours"), LaneSpan(start=0.5, end=1.0, word="spills")),
        SKIPPED_LANE: (LaneSpan(start=0.5, end=1.0, word=SKIPPED_LANE),),
    },
    liquids={
        "beaker": Liquid(
            TIMES, np.array([0.05, 0.03, 0.01]), floor=0.01, radius=0.02, rgba=np.full((3, 4), 200, dtype=np.uint8)
        )
    },
)
END = EffectOutput(events=(EffectEvent(0.1, "end-point", ("beaker",), message="equivalent"),))
DONE = [
    ("task", 0.2, 1.0, "stir"), ("task", 0.8, 1.5, "carry"), ("task", 1.0, 9.0, "tap"), ("stage", -5.0, 2.5, "lesson"),
    ("feature", 0.5, 0.6, "hint"), ("quiz", 1.0, 1.2, "q1"), ("task", -5.0, -1.0, "before"), ("task", 9, 99, "after"),
]  # fmt: skip


def with_effects(result, **outputs):
    """The result with these outputs of effects."""
    runs = {
        kind: EffectRun(
            EffectSpec(kind, "x", lambda _: None),
            ("declared",),
            output,
            seconds=0.1,
            counters={},
            frames=3,
            frames_run=2,
        )
        for kind, output in outputs.items()
    }
    return replace(result, effects=runs)


def with_tasks(result):
    """The result with tasks and stages of the session."""
    zero = int(result.assembly.stamp_ns[0])
    spans = [
        Interval(zero + round(1e9 * start), zero + round(1e9 * end), kind, name) for kind, start, end, name in DONE
    ]
    return replace(result, session=replace(result.session, intervals=spans))


STATES = (
    "several", "only false", "between frames", "undecided", "no contact", "no reference", "effects", "a tradeoff",
    "too few prices", "millimetres", "nothing wrong",
)  # fmt: skip
PICTURES = {
    **{state: lambda _, name=state: run_with_steady_times(name) for state in STATES},
    "taps": lambda taps: with_effects(taps(), pour=POUR, reaction=END),
    "a search that misses": lambda taps: with_tasks(taps("paper", "hybrid-qaco", variant="corrected", budget=300)),
    "a hull": lambda taps: with_effects(taps("hull", "collider", shape="hull"), pour=EffectOutput()),
}


SCENES = {
    scene: lambda _, name=scene: compute(
        synthetic_session(name, seed=0, noise=None)[0], detectors="discrete[rate_hz=22.5]"
    )
    for scene in ("titration", "ammonia-calorimetry", "flame-test")
}


@pytest.fixture(scope="module")
def picture_of(taps, drawn):
    """Draws the run of a name, with times that no machine changes, and reads its picture back; each run once."""

    @cache
    def picture(name):
        return drawn(with_steady_times((PICTURES | SCENES)[name](taps)))

    return picture


@pytest.mark.parametrize("name", PICTURES)
def test_the_picture_reads_as_it_did(name, picture_of, snapshot):
    """The recording of a run, read back as text, equals the stored text, which people reviewed.

    The text is the layout of views from the first to the last, the bookmarks, and times and values of every component;
    of many numbers only sums.
    """
    picture = picture_of(name)
    pieces = layout_of(picture.path)
    (first_container,) = pieces["/viewport"].pop("ViewportBlueprint:root_container")
    lines = [*layout(pieces, f"container/{uuid(first_container)}")]
    lines += [
        f"{path} {name}: {plain(value)}" for path in sorted(pieces) for name, value in sorted(pieces[path].items())
    ]
    lines += map(str, read_bookmarks(picture.path))
    components_of_path = components(
        (path, batch) for path in sorted(picture.entities) for batch in picture.entities[path]
    )
    lines += [
        f"{path} {component}: {in_time(picture.column(path[1:], component))}"
        for path, own in components_of_path.items()
        for component in sorted(own)
        if not path.startswith("/__")
    ]
    assert "\n".join(lines) == snapshot


def layout_of(path):
    """Entity -> its components, of the layout in a recording."""
    reader = RrdReader(path)
    chunks = reader.stream(store=reader.blueprints()[0]).to_chunks()
    return components((chunk.entity_path, chunk.to_record_batch()) for chunk in chunks)


def components(batches):
    """Entity -> component -> its latest value."""
    result = {}
    for path, batch in batches:
        own = result.setdefault(path, {})
        own |= {name: batch.column(name).to_pylist()[-1] for name in batch.schema.names if ":" in name}
    return result


def uuid(number):
    """The sixteen bytes of an id as text."""
    text = bytes(number).hex()
    return "-".join((text[:8], text[8:12], text[12:16], text[16:20], text[20:]))


def layout(pieces, path, depth=0):
    """A line for a container or a view with all that is set of it, then those in it."""
    own = {}
    for piece in sorted(piece for piece in pieces if piece.startswith(f"/{path}")):
        own |= pieces.pop(piece)
    below = own.pop("ContainerBlueprint:contents", ())
    if active := own.pop("ContainerBlueprint:active_tab", ()):
        own["active"] = below.index(active[0])
    yield "  " * depth + "; ".join(
        f"{name.partition(':')[2] or name} {plain(values)}" for name, values in sorted(own.items())
    )
    for inner in below:
        yield from layout(pieces, inner, depth + 1)


FEW = 24
"""Numbers that stand there one by one; of more their sums."""


def in_time(rows):
    """Values with their nanoseconds; of many numbers how many there are, their sums, and those of their places."""
    numbers = np.concatenate([np.ravel(values) for *_, values in rows] or [[]])
    if numbers.dtype.kind in "US" or len(numbers) <= FEW:
        return "; ".join(f"{'' if ns is None else ns} {plain(values)}" for ns, _, values in rows)
    numbers, stamps = numbers.astype(np.float64), [ns or 0 for ns, *_ in rows]
    sizes = [np.size(values) for *_, values in rows]
    sums = (np.nansum(piece) for piece in (numbers, np.abs(numbers), numbers * np.arange(len(numbers)), stamps, sizes))
    return f"{len(rows)} rows, {len(numbers)} numbers, {plain([*sums])}"


def plain(value):
    """Four digits of each number."""
    if isinstance(value, float):
        return f"{round(value, 6) + 0.0:.4g}"
    if isinstance(value, list):
        return f"[{' '.join(map(plain, value))}]"
    return repr(value) if isinstance(value, dict | str) else str(value)


OVER_TIME = {"TimeSeries", "StateTimeline", "TextLog"}
"""Classes of views that show rows of all times; any other shows what is latest at the cursor."""

DRAWN = (
    "positions",
    "strips",
    "vertex_positions",
    "half_sizes",
    "scalars",
    "Measurements:values",
    "state",
    "text",
    "translation",
)
"""Components without which nothing is seen."""


def selected(query, entities):
    """Entities of a query; a later and more exact rule wins, as in the viewer."""
    for entity in entities:
        rules = [
            (len(path), line.startswith("-"))
            for line in query
            for path in [line.lstrip("+- ")]
            if entity == path or (path.endswith("/**") and (entity + "/").startswith(path[:-2]))
        ]
        if rules and not max(rules)[1]:
            yield entity


def visible_values(picture, entity, over_time, ns):
    """How many values that can be seen an entity has at the cursor, or ever in a view of all times."""
    names = {name for batch in picture.entities[entity] for name in batch.schema.names if name.endswith(DRAWN)}
    rows = [picture.column(entity.removeprefix("/"), name) for name in names]
    if not over_time:
        rows = [[row for row in some if row[0] is None or row[0] <= ns][-1:] for some in rows]
    return sum(len(values) for some in rows for *_, values in some)


def views_of(pieces):
    """Yields for each view of a layout: its settings, the lines of its query, and the entity that its eye follows."""
    for path, view in pieces.items():
        if "ViewBlueprint:display_name" in view:
            (origin,) = view["ViewBlueprint:space_origin"]
            query = [line.replace("$origin", origin) for line in pieces[f"{path}/ViewContents"]["ViewContents:query"]]
            followed = pieces.get(f"{path}/EyeControls3D", {}).get("EyeControls3D:tracking_entity", ())
            yield view, query, followed


PICTURE_NAMES = [*PICTURES, *(pytest.param(scene, marks=pytest.mark.slow) for scene in SCENES)]


@pytest.mark.sampled(13)
@pytest.mark.parametrize(
    "fraction",
    [
        pytest.param(0.0, id="begin"),
        pytest.param(0.31, id="31 % of the way to the last moment"),
        pytest.param(1.0, id="last moment"),
        pytest.param(None, id="where the picture opens"),
    ],
)
@pytest.mark.parametrize("name", PICTURE_NAMES)
def test_no_view_of_a_picture_is_empty(name, fraction, picture_of):
    """With the cursor at a time, each view of the layout has something to draw in the entities that its query selects.

    Views of all times, such as plots, have it at any time.
    """
    picture = picture_of(name)
    bookmarks = read_bookmarks(picture.path)
    opening_ns = sum(bookmark.session_ns for bookmark in bookmarks if bookmark.leads)  # one leads at most; else 0
    last_ns = max((bookmark.session_ns for bookmark in bookmarks), default=0)
    cursor_ns = opening_ns if fraction is None else int(fraction * last_ns)
    views = [*views_of(layout_of(picture.path))]
    assert views
    for view, query, _followed in views:
        (view_class,) = view["ViewBlueprint:class_identifier"]
        entities = selected(query, picture.entities)
        assert sum(visible_values(picture, entity, view_class in OVER_TIME, cursor_ns) for entity in entities), view


@pytest.mark.sampled(13)
@pytest.mark.parametrize("name", PICTURE_NAMES)
def test_views_of_a_picture_name_recorded_entities_only(name, picture_of):
    """Entities that a view's query names exactly, and the one that its eye follows, are in the recording.

    Lines of a query with a wildcard, or with a minus (left out), are no exact names; liquids are in some vessels only.
    """
    picture = picture_of(name)
    views = [*views_of(layout_of(picture.path))]
    assert views
    for view, query, followed in views:
        exact = {line for line in query if not line.startswith("-") and not line.endswith(("*", "/liquid"))}
        assert {*exact, *followed} <= {*picture.entities}, view

"""The embedded layout names only what is in the recording, opens on the audit, and stands still."""

import re

import pytest
from rerun.chunk import RrdReader

from replay.outputs.rerun_log.overview import read_moments


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


def test_the_close_up_follows_the_camera_in_the_data(layout, read):
    tracked = [
        v["EyeControls3D:tracking_entity"] for v in layout.values.values() if "EyeControls3D:tracking_entity" in v
    ]
    assert sorted(tracked) == [["/world/focus/eye"], ["/world/missed/eye"]]
    assert {path for (path,) in tracked} <= set(read.entities)


@pytest.mark.slow
def test_hundreds_of_misses_are_listed_by_clusters_first_and_each_in_a_tab_beside(hundreds, layout):
    views = Layout(hundreds[1].path).views()
    (first,) = [query for name, query in views.items() if re.match(r"22\.5Hz missed \d+ of \d+", name)]
    assert any("/report/clusters" in line for line in first) and any("/report/missed" in line for line in views["All"])
    assert "All" not in layout.views(), "a dozen misses need no clusters"

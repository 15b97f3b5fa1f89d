import json
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pyarrow.parquet as pq
import pytest
from support.small_worlds import cubes

from cdcore.detectors import DETECTORS
from cdcore.kernels import compiling
from replay.api.runner import run
from replay.base.machine import processor
from replay.errors import TradeoffError
from replay.outputs.report.tradeoff import title_of, tradeoff_files, write_tradeoff
from replay.tradeoffs import sweep as trading
from replay.tradeoffs.settings import ASKED, Setting
from replay.tradeoffs.sweep import tradeoff
from replay.tradeoffs.timing import timed

LIST = (
    Setting("hybrid", "as it comes", ""), Setting("exact", "as it comes", ""),
    Setting("discrete", "step rate", "20 Hz", {"rate_hz": 20.0}),
    Setting("hybrid", "mesh resolution", "500 mm", cell=0.5), Setting("sphere", "as it comes", ""),
)  # fmt: skip


def test_misses_are_those_of_the_audit(bumped):
    done = tradeoff(bumped, settings=LIST, repeats=2)
    audit = run(bumped, detectors="slow=discrete[rate_hz=20]", oracle="exact").summary["audit"]["slow"]
    row = next(one for one in done.rows if one["axis"] == "step rate")
    assert row["missed_pair_frames"] == audit["pair_frames"]["MISSED"] > 0
    assert row["invented_pair_frames"] == audit["pair_frames"]["INVENTED"]
    assert (row["missed"], row["missed_low"], row["missed_high"]) == tuple(
        audit["missed"][key] for key in ("share", "low", "high")
    )
    assert row["contacts_missed"] == audit["contacts_missed"] and row["contacts"] == audit["contacts"]


def test_two_runs_give_the_same_recalls_and_only_times_differ(bumped):
    alone = [Setting(name, "as it comes", "") for name in DETECTORS if name not in ("hybrid", "exact", "sphere")]
    one, two = (tradeoff(bumped, settings=[*LIST, *alone], repeats=1, time_limit=None) for _ in range(2))
    assert {row["detector"] for row in one.rows} == set(DETECTORS)
    for a, b in zip(one.rows, two.rows, strict=True):
        assert {key: a[key] for key in ("label", "recall", "precision", "digest", "work", "mesh_faces")} == {
            key: b[key] for key in ("label", "recall", "precision", "digest", "work", "mesh_faces")
        }


def test_the_oracle_is_in_the_table_but_not_on_the_front(bumped):
    done = tradeoff(bumped, settings=LIST, repeats=1)
    assert [row["label"] for row in done.rows if row["oracle"]] == ["exact"] and "exact" not in done.front
    assert "sphere" not in done.front, "it invents more than it finds"
    json.dumps(done.as_json(), allow_nan=False)


def test_a_time_limit_cuts_the_tail_and_says_so(bumped, monkeypatch):
    clock = iter(range(100000))
    monkeypatch.setattr(trading, "perf_counter", lambda: float(next(clock)))
    done = tradeoff(bumped, settings=LIST, time_limit=8.0)
    assert 1 <= len(done.rows) < len(LIST)
    assert done.cut == tuple(one.label for one in LIST[len(done.rows) :])


def test_compiling_does_not_count_towards_the_time_limit(bumped, monkeypatch):
    @contextmanager
    def half_an_hour(tell):
        yield SimpleNamespace(seconds=1800.0)

    monkeypatch.setattr(compiling, "compiling_reported", half_an_hour)
    clock = iter(range(100000))
    monkeypatch.setattr(trading, "perf_counter", lambda: float(next(clock)))
    assert not tradeoff(bumped, settings=LIST, repeats=1, time_limit=8.0).cut


def test_what_its_warm_up_foretells_to_take_too_long_is_not_begun_and_the_next_is(bumped, monkeypatch):
    def slow(detector, motion, *, faces):
        detection, clock = timed(detector, motion, faces=faces)
        return detection, replace(clock, seconds=1e6) if detector.name == "exact" else clock

    monkeypatch.setattr(trading, "timed", slow)
    done = tradeoff(bumped, settings=LIST, repeats=1, time_limit=1e4)
    assert done.cut == ("exact",) and len(done.rows) == len(LIST) - 1


def test_a_detector_is_warm_before_its_first_pass_counts(bumped, monkeypatch):
    seen = []

    def watched(detector, motion, *, faces):
        seen.append((detector.name, len(motion)))
        return timed(detector, motion, faces=faces)

    monkeypatch.setattr(trading, "warm_frames", lambda count: np.arange(5))
    monkeypatch.setattr(trading, "timed", watched)
    done = tradeoff(bumped, settings=LIST[:3], repeats=1)
    assert seen == [(one.detector, frames) for one in LIST[:3] for frames in (5, 12)]
    assert [row["passes"] for row in done.rows] == [1, 1, 1]


def test_faces_cost_time_and_find_the_same_contacts(bumped):
    listed = [Setting("hybrid", ASKED, "booleans"), Setting("hybrid", ASKED, "faces", faces=True)]
    booleans, faces = tradeoff(bumped, settings=listed, repeats=1).rows
    assert (booleans["recall"], booleans["digest"]) == (faces["recall"], faces["digest"])
    assert booleans["face_recall"] is None and faces["face_recall"] == 1.0
    assert faces["work"]["face_pairs"] > booleans["work"]["face_pairs"] == 0


def test_all_have_seconds_per_session_minute_and_those_that_can_be_asked_live_have_quantiles(bumped):
    never = Setting("continuous", "as it comes", "")
    done = tradeoff(bumped, settings=[*LIST, never], repeats=2)
    minutes = done.about["seconds"] / 60
    for row in done.rows:
        assert row["seconds_per_minute"] == pytest.approx(row["seconds"] / minutes)
        assert row["ms_per_frame"] == pytest.approx(1e3 * row["seconds"] / done.about["frames"])
        quantiles = [row[f"p{level}_ms"] for level in (50, 95, 99)]
        told = None not in quantiles and row["over_share"] is not None
        assert row["work"] and row["online"] == (row["detector"] != "continuous") == told
        assert not row["online"] or quantiles == sorted(quantiles)
    assert done.about["machine"]["processor"] == processor() and done.about["processor_share"] > 0


def test_passes_go_round_and_every_step_is_told(bumped):
    told = []
    done = tradeoff(bumped, settings=LIST, repeats=3, watch=lambda *step: told.append(step[:3]))
    labels = [one.label for one in LIST]
    assert [label for _, _, label in told] == [*labels * 3, ""] and told[-1][:2] == (15, 15)
    assert [done for done, _, _ in told] == list(range(16))
    assert all(row["passes"] >= 3 and row["ms_per_frame"] <= row["ms_median"] <= row["ms_high"] for row in done.rows)


def test_a_session_without_contact_is_refused():
    with pytest.raises(TradeoffError, match="nothing can be missed"):
        tradeoff(cubes({"a": [0, 0, 0], "b": [3, 4, 3]}), settings=LIST)


def test_table_and_json_say_the_same(bumped, tmp_path):
    done = tradeoff(bumped, settings=[Setting(name, "as it comes", "") for name in ("hybrid", "static")])
    write_tradeoff(done, tmp_path)
    names = ["tradeoff-dark.png", "tradeoff.json", "tradeoff.parquet", "tradeoff.png", "tradeoff.svg"]
    assert sorted(path.name for path in tmp_path.iterdir()) == names
    told = json.loads((tmp_path / "tradeoff.json").read_text("utf-8"))
    table = pq.read_table(tmp_path / "tradeoff.parquet").to_pylist()
    assert [{**row, "work": json.loads(row["work"])} for row in table] == told["rows"] == list(done.rows)
    assert told["machine"]["cores"] >= 1 and "2 contacts" in title_of(done)
    with tradeoff_files(done) as files:
        assert sorted(files) == names and all(path.is_file() for path in files.values())
    assert not any(path.exists() for path in files.values())

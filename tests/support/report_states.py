"""Runs in all states: documents by hand, tradeoff rows, received folders, and their pages."""

import json
import re
from dataclasses import replace
from functools import cache
from html import unescape

import numpy as np
from msgspec import convert, structs
from support.planted_faults import FAULTS, clean_draft
from support.planted_sessions import run
from support.small_worlds import cube, jumping, unit_cubes_on_x

from replay.advice.pareto import advice_of, front_of
from replay.auditing.wilson import proportion
from replay.document import audit as records
from replay.document.answer import Fix, FixFigures
from replay.document.before_after import change_text, errors_of_rank
from replay.document.decision import SHIP_COMMAND
from replay.document.detector import DetectorRecord, DetectorTimes, LongestStage, SampleTimes
from replay.document.diagnosis import answers_of_run
from replay.document.ranking import ranking
from replay.document.run_document import RunDocument
from replay.document.run_result import Tradeoff
from replay.engine import compute
from sessions import MeshData
from sessions.model.event import LiveContact
from sessions.model.scene import Scene, SceneBody, SceneEffect

NONE = proportion(0, 0)
COUNTS = records.CountRange(smallest=0, largest=0, mean=0.0)


def zeros(record, **counts):
    """A record of counts, all 0 but those given."""
    return record(**(dict.fromkeys(record.__struct_fields__, 0) | counts))


MATCHING = records.ContactMatching(
    **dict.fromkeys(records.ContactMatching.__struct_fields__, 0)
    | {"missed_proportion": NONE, "false_proportion": NONE}
    | {"onset_error": None, "duration_error": None, "end_error": None}
)


def offset_ranges(missed=0, late=0):
    """The same counts at every sampling offset."""
    same = [records.CountRange(smallest=count, largest=count, mean=float(count)) for count in (missed, late)]
    return records.OffsetRanges(contacts_missed=same[0], late_or_cut_short=same[1])


def audit_of(**fields):
    """The audit of a detector with some values; ranges over the sampling offsets are those of its counts."""
    empty = dict.fromkeys(records.DetectorAudit.__struct_fields__, 0)
    empty |= {
        "pair_frames": zeros(records.PairFrames), "time_missed": NONE, "false_contact": NONE, "undecided": NONE,
        "undecided_reasons": {}, "reference_undecided_reasons": {}, "between_frames": records.NOT_EXAMINED,
        "while_grasped": zeros(records.GraspedCounts), "misses_by_kind": {}, "false_causes": {},
        "means_over_offsets": None, "noise_proof": None, "matching": MATCHING,
        "causes": records.CauseCounts(misses={}, pair_frames={}, examined=0, missed=0),
        "counts_over_offsets": offset_ranges(fields.get("contacts_missed", 0), fields.get("late_or_cut_short", 0)),
    }  # fmt: skip
    return records.DetectorAudit(**empty | fields)


def times_of(mean=4e-4, p99=None):
    """Seconds of a detector; without ``p99`` it was not timed frame by frame."""
    samples = SampleTimes(median=p99, p95=p99, p99=p99, max=p99, samples=1, over_budget=0.0, stages={}) if p99 else None
    return DetectorTimes(
        prepare=0.0, warm_up=0.0, detect=100 * mean, per_frame_mean=mean, stages={}, longest_stage=None,
        sample_times=samples,
    )  # fmt: skip


def detector_of(name, spec=None, **fields):
    """A detector of a run that was asked live."""
    usual = {
        "settings": {}, "covers": "instants", "online": True, "live": True, "approximate": False, "contacts": 0,
        "faces_queried": False, "verdicts": {}, "seconds": times_of(), "work": {}, "digest": None, "faces_digest": None,
    }  # fmt: skip
    return DetectorRecord(name=name, spec=spec or name, **usual | fields)


EMPTY = convert(
    {
        "schema": "vrlab-replay/run/2", "caveat": "", "intervals": "", "window": {"start": None, "end": None},
        "session": {
            "id": "0" * 16, "recording": None, "digest": None, "scene": "", "frames": 1, "duration": 0.0,
            "median_step": 0.0, "dropped_frames": {"repeated": 0, "backwards": 0}, "first_stamp_ns": 0, "left_out": [],
            "notes": [], "facts": {}, "facts_withheld": 0, "assumptions": [], "bodies": {},
        },
        "settings": {
            "detectors": [], "oracle": "none", "step_rate": 50.0, "pairs": None, "start": None, "end": None,
            "policy": {}, "noise": [], "noise_copies": 16, "seed": 0, "tau": 0.0, "offline": False,
        },
        "seed": 0, "tau": 0.0, "pairs": [], "oracle": "", "detectors": {}, "audit": {}, "noise": None, "policy": {},
        "findings": [], "flagged": [], "flagged_verdicts": {}, "versions": {}, "machine": {}, "effects": {},
        "plan": {
            "effects": {}, "pairs": None, "bodies": {}, "topics": {}, "detectors": {}, "detection": True, "not_run": [],
        },
        "answers": [],
    },
    RunDocument,
)  # fmt: skip


def document_with(**fields):
    """A document with some values."""
    return structs.replace(EMPTY, **fields)


CHECK = {"passes": 7, "ratio": 1.0, "low": 0.98, "high": 1.02, "tie": True, "widened": 1.0}
ABOUT = {
    "session": "s", "contacts": 18, "frames": 6, "seconds": 60.0, "bodies": 2, "pairs": 1, "oracle": "exact",
    "processor_share": 1.0, "machine": {"system": "Linux", "processor": "x", "cores": 2}, "reference": "exact",
    "live_frames": 6, "clock": CHECK, "time_limit": 20.0,
}  # fmt: skip


def price_row(label, ms, missed, late=0, false=0, *, spread=0.1, p99=None, **more):
    """A setting that takes ``ms`` a frame and gets so many of 18 contacts wrong; a count may be a range (low, high)."""
    counts = {}
    for name, count in {"missed": missed, "late": late, "false_contacts": false}.items():
        lower, upper = count if isinstance(count, tuple) else (count, count)
        counts |= {name: (lower + upper) / 2, f"{name}_smallest": lower, f"{name}_largest": upper}
    # Any order of losses will do for a front: here a contact missed, late or false costs the same.
    loss = sum(counts[name] for name in ("missed", "late", "false_contacts")) / 18
    return {
        "label": label, "settings": label, "detector": label, "line": "", "value": "", "rate_hz": None,
        "complete": False, "oracle": False, "contacts": 18, "contacts_undecided": 0,
        "contact_frames_undecided": 0, "offsets": 1, "not_reported": 0.0,
        "false": counts["false_contacts"] / 50, "loss": loss, **counts,
        "mean_ms": ms, "mean_low": None if spread is None else (1 - spread) * ms,
        "mean_high": None if spread is None else (1 + spread) * ms,
        "p99_ms": 2 * ms if p99 is None else p99, "p99_low": None, "p99_high": None,
        "passes": 1 if spread is None else 7,
        "frames": 6, "work": {"looks": 3}, "digest": "d", "prepare_seconds": 0.0, "front": False, **more,
    }  # fmt: skip


def surely_quicker(a, b):
    """Whether the intervals of two settings' times are apart; by the means where one has no interval."""
    gap = None not in (a["mean_high"], b["mean_low"]) and a["mean_high"] < b["mean_low"]
    unknown = None in (a["mean_low"], b["mean_low"])
    return gap or (unknown and a["mean_ms"] < b["mean_ms"])


def front(rows):
    """Labels, most accurate first: the next is the first by accuracy that is surely quicker than the one before."""
    left = [row for row in rows if not row["contact_frames_undecided"]]
    labels, last = [], None
    for least in sorted({row["loss"] for row in left}):
        alike = [row for row in left if row["loss"] == least]
        quickest = sorted(alike, key=lambda row: row["mean_ms"])[0]
        tied = [row for row in alike if row is quickest or not surely_quicker(quickest, row)]
        best = sorted(tied, key=lambda row: not row["complete"])[0]
        if last is None or surely_quicker(best, last):
            labels.append(best["label"])
            last = best
    return labels[::-1]


def tamper(folder, section, **changes):
    """Write other values into a part of the summary of a run; a table that is there keeps its other keys."""
    file = folder / "summary.json"
    summary = json.loads(file.read_text())
    kept = summary[section]
    summary[section] |= {
        key: kept[key] | new if isinstance(kept.get(key), dict) else new for key, new in changes.items()
    }
    file.write_text(json.dumps(summary))


POSITIONS = {"a": [0.0] * 8, "b": [3, 0.9, 3, 3, 3, 3, 3, 3], "c": [-3, -3, -3, -0.9, -3, -0.9, -0.9, -3]}
"""At 100 Hz; samples at 50 Hz fall on even frames: they miss a-b and a-c whole, find a-c late, and hold it too long."""

SCENE = Scene(
    bodies=(SceneBody("a"), SceneBody("b")),
    effects=(SceneEffect("contact", {"between": ["a", "b"]}),),
)
HAZARD = replace(SCENE, effects=(SceneEffect("hazard-proximity", {"of": "a", "hazard": "b", "distance": 0.2}),))
TWO = "slow=discrete[rate_hz=50],more=discrete[rate_hz=25]"
MANY = {f"b{k:02}": [3.0 + 2 * k] * (4 * k) + [0.9] + [3.0 + 2 * k] * (4 * (9 - k) + 3) for k in range(9)}
RUN_OF_STATE = {  # what a run may show its reader -> makes such a run
    "several": lambda: compute(unit_cubes_on_x(POSITIONS), detectors=TWO, oracle="exact"),
    "nothing wrong": lambda: compute(
        unit_cubes_on_x(
            {"a": [0] * 4, "b": [0.9, 0.9, 2, 3], "c": [-3, -3, -3, -0.9]}, facts={"vr_type": "desktop", "who": "x"}
        ),
        detectors="exact",
        oracle="hybrid",
    ),
    "no contact": lambda: run("none"),
    "one missed": lambda: run("one"),
    "undecided": lambda: run("undecided"),
    "not measured": lambda: run("not measured"),
    "only false": lambda: compute(
        unit_cubes_on_x({"a": [0.0] * 6, "b": [3.0, 1.02, 1.01, 1.02, 3.0, 3.0]}),
        detectors="c=collider[shape=box,skin_m=0.05]",
    ),
    "between frames": lambda: compute(jumping(), detectors="exact", oracle="continuous"),
    "no reference": lambda: compute(unit_cubes_on_x(POSITIONS), detectors="exact,sphere", oracle="none"),
    "effects": lambda: compute(
        unit_cubes_on_x({"a": [0.0] * 12, "b": [0.9, 0.9, 3.0] * 4}, scene=HAZARD), detectors=()
    ),
    "effects beside an audit": lambda: compute(
        unit_cubes_on_x({"a": [0.0] * 12, "b": [0.9, 0.9, 3.0] * 4}, scene=SCENE), detectors="exact", oracle="hybrid"
    ),
    "findings": lambda: doubtful(),
    "nine pairs": lambda: compute(unit_cubes_on_x({"a": [0.0] * 40, **MANY}), detectors="slow=discrete[rate_hz=12]"),
    "in a hollow": lambda: gated(0.0),
    "in a hollow that is cut": lambda: cut_gate(),
    "beside a hollow": lambda: gated(0.49),
    "millimetres": lambda: compute(
        unit_cubes_on_x({"a": [0.0] * 12, "b": [3000, 3000, 0.9, 3000, 0.9, 0.8] * 2}), detectors="hybrid"
    ),
    "inside undecided": lambda: opened(),
    "not live": lambda: compute(jumping(), detectors="hybrid,a=continuous,b=continuous"),
    "offline": lambda: compute(jumping(), detectors="hybrid", offline=True),
    "a tradeoff": lambda: traded(
        price_row("often", ms=0.5, missed=(0, 1), late=1, false=2),
        price_row("seldom", ms=0.05, missed=2),
        price_row("never", ms=9.0, missed=8),
        cut=("d", "e"),
    ),
    "too few prices": lambda: traded(price_row("a", ms=0.5, missed=2), cut=("b",)),
    "no price": lambda: traded(),
    "an undecided price": lambda: traded(price_row("a", ms=0.5, missed=2, contact_frames_undecided=1)),
}


def gated(position):
    """A ball between the walls of a gate, or beside it, and the hull of both walls."""
    walls = [cube().vertices * (0.1, 1, 1) + (x, 0, 0) for x in (-0.3, 0.3)]
    gate = MeshData(np.concatenate(walls), np.concatenate([cube().faces, cube().faces + 8]))
    session = unit_cubes_on_x({"gate": [0.0] * 4, "ball": [3.0, position, position, 3.0]})
    return compute(replace(session, meshes={"gate": gate, "ball": cube(0.2)}), detectors="hull=collider[skin_m=0.04]")


def cut_gate():
    """A run without a contact, whose only false one is gone once the gate is cut into its two walls."""
    result = gated(0.0)
    none, rank = proportion(0, 0), result.ranking[0]
    figures = FixFigures(
        what="2 convex pieces", missed=none, late_or_cut_short=none, time_missed=none, false=none,
        missed_counts=(0, 0), late_counts=(0, 0), offsets=1, mean=4e-5, p99=1e-4,
    )  # fmt: skip
    after = replace(errors_of_rank(rank, None), false=0.0)
    fix = Fix(
        text="Split gate into 2 convex pieces.", measured=True, command=SHIP_COMMAND, setting="collider",
        figures=figures, change=f"{change_text(errors_of_rank(rank, None), after)}.",
    )  # fmt: skip
    return with_fix(result, fix)


def with_fix(result, fix):
    """The run with another Fix of the worst detector; as it is where there is none."""
    if fix is None or fix.command != SHIP_COMMAND:
        return result
    made = (structs.replace(result.answers[0], fix=fix), *result.answers[1:])
    return replace(result, answers=made, document=structs.replace(result.document, answers=made))


def opened():
    """A run in which nobody can say what is inside a body, because it lacks a side."""
    box = cube()
    top = (box.triangles[:, :, 2] == box.bounds[1, 2]).all(axis=1)
    cup = MeshData(9 * box.vertices, box.faces[~top])
    session = unit_cubes_on_x({"a": [0] * 4, "b": [0.2, 0.3, 4.5, 9.0]})
    return compute(replace(session, meshes={"a": cup, "b": box}), detectors="hull=collider")


def traded(*rows, cut=()):
    """A run with settings that were tried, and others that were not."""
    done = Tradeoff(rows, tuple(front_of(rows)), tuple(advice_of(rows)), cut, ABOUT)
    return replace(run("several"), tradeoff=done)


def doubtful():
    """A frozen hand that is filled in, and a pose that is no number and left out."""
    draft = clean_draft()
    FAULTS["frozen pose"](draft, body=1, frame=300)
    FAULTS["nan position"](draft, body=0, frame=500)
    return compute(
        draft.session(), detectors="sphere", oracle="none", policy=["frozen=interpolate:2", "not-finite=drop"]
    )


@cache
def run_with_steady_times(state, mean=4e-5):
    """A run in a state, of ``RUN_OF_STATE`` or one whose engine reported, with times that no machine changes."""
    return with_steady_times(RUN_OF_STATE[state]() if state in RUN_OF_STATE else compute(reported(state)), mean)


SCREENS = ("no contact", "one missed", "several", "undecided", "not measured", "only false", "busy")
"""States in which numbers of all outputs are compared."""


def result_of(state):
    """A run in a state whose times are the same on every machine."""
    if state != "busy":
        return run_with_steady_times(state)
    result = run_with_steady_times("several")
    detectors = {
        label: structs.replace(detector, seconds=structs.replace(detector.seconds, processor_fraction=0.4))
        for label, detector in result.document.detectors.items()
    }
    return replace(result, document=structs.replace(result.document, detectors=detectors))


def with_steady_times(result, mean=4e-5):
    """A run whose times are the same on every machine: 0.04 ms a frame, 0.1 ms in 99 of 100, nothing else at work."""
    samples = SampleTimes(
        median=mean, p95=2 * mean, p99=2.5 * mean, max=3 * mean, samples=1, over_budget=0.0, stages={}
    )
    steady_detectors = {
        label: structs.replace(
            detector,
            seconds=structs.replace(
                detector.seconds,
                per_frame_mean=mean,
                processor_fraction=1.0,
                detect=100 * mean,
                longest_stage=LongestStage(stage="search", fraction=0.5),
                sample_times=samples,
            ),
        )
        for label, detector in result.document.detectors.items()
    }
    document = structs.replace(
        result.document,
        detectors=steady_detectors,
        versions={"vrlab-replay": "1"},
        machine={"processor": "x", "cores": 2},
        effects={
            kind: structs.replace(effect, seconds=mean, fraction=0.01)
            for kind, effect in result.document.effects.items()
        },
    )
    phases = {
        label: replace(offsets, every_frame=with_steady_time(offsets.every_frame))
        for label, offsets in result.phases.items()
    }
    result = replace(result, phases=phases)
    ranks = ranking(document) if result.ranking else ()
    fix = result.answers[0].fix if result.answers else None
    steady_answers = answers_of_run(result, document, ranks)
    document = structs.replace(document, answers=steady_answers)
    detections = {label: replace(item, seconds=stages(item.seconds)) for label, item in result.detections.items()}
    result = replace(result, document=document, ranking=ranks, answers=steady_answers, detections=detections)
    return with_fix(result, fix)


def stages(seconds):
    """Seconds of each stage, a multiple of 10 microseconds; three times as many for the first frame."""
    made = {}
    for rank, (name, value) in enumerate(seconds.items(), 1):
        made[name] = 1e-5 * rank * (1.0 + np.zeros_like(value))
        if np.ndim(value):
            made[name][0] *= 3
    return made


def with_steady_time(every_frame):
    """The detector at every frame, 0.05 ms each where that was timed."""
    if every_frame is None or every_frame.seconds is None:
        return every_frame
    return replace(every_frame, seconds=5e-5)


def reported(state):
    """A session of two cubes that meet in frames 1, 2 and 6, with or without reports of an engine."""
    session = unit_cubes_on_x({"a": [0.0] * 12, "b": [3, 0.9, 0.9, 3, 3, 3, 0.9, 3, 3, 3, 3, 3]})
    if state == "unasked":
        return session
    return replace(
        session, live_contacts=(LiveContact(0, "a", "b", "enter"), LiveContact(30_000_000, "a", "b", "exit"))
    )


def read_page(page):
    """Text that a reader sees, a line a block, without charts, and what links lead to."""
    page = re.sub(r"<(style|script|svg|title)\b.*?</\1>", "", page, flags=re.DOTALL)
    page = " ".join(page.split())  # line ends of a template are no words
    page = re.sub(r'<[^>]*\b(?:id="((?:miss|false)-[^"]*)"|class="(worst [^"]*)")[^>]*>', r"\g<0>[\1\2] ", page)
    page = re.sub(r"</(?:th|td|dt|span|a|b)>", r"\g<0> ", page)
    page = re.sub(r"<(?:p|article|h[123]|tr|dd|dt|li|summary|caption|header|figcaption|small)\b", r"\n\g<0>", page)
    text = unescape(re.sub("<[^>]*>", "", page))
    text = re.sub(r"\b[0-9a-f]{16}\b", "#", text)  # made of all digits of every pose
    lines = (" ".join(line.split()) for line in text.splitlines())
    return "\n".join(line for line in lines if line)

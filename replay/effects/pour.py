"""Liquid leaves a tilted vessel as soon as the tilt keeps less than stands in it, and goes where it falls."""

import numpy as np

from replay.effects.declaring import Declaration, bodies, number
from replay.effects.fitting import HALF_WINDOW, LEAST_SAMPLES, fitted, settled_runs
from replay.effects.inputs import EffectInputs
from replay.effects.models.tilted import tilt_of_onset, volume_kept
from replay.effects.models.transfers import GAP_S, Ledger, Liquids, Transfer, flows
from replay.effects.output import EffectOutput, Findings, FloatArray, LaneSpan, Vector
from replay.effects.protocol import EffectSpec
from replay.effects.vessels import ML, Vessel, flow_event, landing, vessels_of, volumes
from replay.errors import EffectError
from sessions.model.scene import Scene


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``pour`` with volume and target, the volume of every vessel as a series; what misses is for ``spill``."""
    routes: dict[str, tuple[str, ...]] = {}
    for declared in inputs.declared:
        for source in declared.bodies("from"):
            others = (name for name in declared.bodies("into") if name != source)
            routes[source] = tuple(dict.fromkeys((*routes.get(source, ()), *others)))
    names = tuple(dict.fromkeys((*routes, *(name for targets in routes.values() for name in targets))))
    bench = _Bench(inputs, vessels_of(inputs, names), routes)
    initial = dict(bench.ledger.volume_ml)
    bench.run()
    moved = tuple(bench.ledger.transfers)
    least = min((declared.number("least_ml") for declared in inputs.declared), default=0.0)
    found = Findings(len(inputs))
    found.ran = bench.ran
    for flow in flows(moved, least):
        source, target = flow[0].source, flow[0].target
        if target:
            found.events.append(flow_event(inputs, flow, "pour", f"poured from {source} into {target}"))
        found.lane(source, LaneSpan(flow[0].time, flow[-1].time, f"into {target}" if target else "spills"))
    every = sorted((*moved, *bench.received), key=lambda one: one.frame)
    for name, one in volumes(inputs.times, initial, tuple(every)).items():
        found.series[f"{name}/volume"] = one
        found.liquids[name] = bench.vessels[name].drawn(one.times, one.values)
    return found.output(Liquids(initial, moved))


class _Bench:
    """The vessels, and where each of them will pour next."""

    def __init__(self, inputs: EffectInputs, vessels: dict[str, Vessel], routes: dict[str, tuple[str, ...]]) -> None:
        self.inputs, self.vessels, self.routes = inputs, vessels, routes
        self.ledger = Ledger({name: vessel.volume_ml for name, vessel in vessels.items()})
        self.ran = np.zeros(len(inputs), dtype=np.bool_)
        self.poses = {name: inputs.poses(name) for name in vessels}
        self.held = {name: poses.held() for name, poses in self.poses.items()}
        self.tilts: dict[str, FloatArray] = {}
        self.after, self.next = dict[str, int](), dict[str, int]()
        self.coming, self.received = list[Transfer](), list[Transfer]()
        if inputs.has("burette"):
            moved: Liquids = inputs.output("burette").data
            self.coming = [one for one in moved.transfers if one.target in vessels]
        for source in routes:
            if vessels[source].cylinder is None:
                raise EffectError(
                    f"scene: body {source!r} is poured from and its cavity has no radius and height; give those of the "
                    "cylinder that it is, from its floor to its lip"
                )
            poses = self.poses[source]
            # A frame reached by a jump or a loss is no evidence of a tilt: a glitch of one frame would empty the glass.
            known = poses.valid & poses.linked
            known[:1] |= poses.valid[:1]
            self.tilts[source] = np.where(known, poses.tilt(), np.nan)
            self.after[source] = 0
            inputs.count("tilts compared", int(known.sum()))
            self._look_ahead(source)

    def run(self) -> None:
        """Pour, frame by frame, wherever a tilt is beyond what its vessel keeps."""
        while True:
            frame, source = min((frame, source) for source, frame in self.next.items())
            if self.coming and self.coming[0].frame <= min(frame, len(self.inputs)):
                self._receive(self.coming.pop(0))
            elif frame < len(self.inputs):
                self._pour(frame, source)
            else:
                return

    def _receive(self, coming: Transfer) -> None:
        """Book what another effect moves here; it keeps its own account of it."""
        self.ledger.volume_ml[coming.target] += coming.volume_ml
        self.received.append(coming)
        if coming.target in self.routes:
            self.after[coming.target] = max(self.after[coming.target], coming.frame)
            self._look_ahead(coming.target)

    def _pour(self, frame: int, source: str) -> None:
        self.ran[frame] = True
        sizes = self.vessels[source].cylinder
        assert sizes is not None
        kept = volume_kept(float(self.tilts[source][frame]), *sizes) / ML
        self.inputs.count("volumes kept")
        self.after[source] = frame + 1
        leaving = self.ledger.volume_ml[source] - kept
        target = ""
        if leaving > 0.0:
            targets = {name: self.held[name] for name in self.routes[source]}
            start, velocity = self._exit(frame, source), self._velocity(frame, source)
            target, point = landing(self.inputs, self.vessels, targets, frame, start, velocity)
            self._book(frame, source, target, leaving, point)
        # What is left is what this tilt keeps: it pours again beyond it, and no onset has to be searched for.
        self._look_ahead(source, float(self.tilts[source][frame]) if leaving > 0.0 else None)
        if target in self.routes:
            # What it received came now: frames before this one are over.
            self.after[target] = max(self.after[target], frame)
            self._look_ahead(target)

    def _book(self, frame: int, source: str, target: str, volume_ml: float, point: Vector) -> None:
        time = float(self.inputs.times[frame])
        self.ledger.move(Transfer(frame, time, source, target, volume_ml, point))
        # A vessel that may pour runs over by its own tilt; one that only receives, by its brim.
        over = self.ledger.volume_ml[target] - self.vessels[target].brim_ml if target else 0.0
        if over > 0.0 and target not in self.routes:
            self.ledger.move(Transfer(frame, time, target, "", over, point))

    def _look_ahead(self, source: str, onset: float | None = None) -> None:
        sizes = self.vessels[source].cylinder
        assert sizes is not None
        volume = self.ledger.volume_ml[source]
        if onset is None:
            # An overfull vessel runs over at any tilt, an empty one at none.
            onset = -1.0 if volume * ML > volume_kept(0.0, *sizes) else tilt_of_onset(volume * ML, *sizes)
        start = self.after[source]
        later = self.tilts[source][start:] > onset
        found = volume > 0.0 and bool(later.any())
        self.next[source] = start + int(np.argmax(later)) if found else len(self.inputs)

    def _exit(self, frame: int, source: str) -> FloatArray:
        """Where it leaves: the lip, or the lowest point of the rim where that is lower."""
        vessel, poses = self.vessels[source], self.poses[source]
        turn, place = poses.rotation[frame], poses.translation[frame]
        lip = place + turn @ vessel.place("lip")
        disc = vessel.opening(poses, frame)
        down = np.array([0.0, -1.0, 0.0])
        along = down - (down @ disc.normal) * disc.normal
        length = float(np.sqrt(along @ along))
        lowest = disc.centre + (disc.radius / length * along if length > 0.0 else 0.0)
        return np.asarray(lip if lip[1] <= lowest[1] else lowest)

    def _velocity(self, frame: int, source: str) -> FloatArray:
        """Of the lip, which the liquid leaves with; at rest where the path about the frame is not known."""
        poses = self.poses[source]
        rows = slice(max(0, frame - HALF_WINDOW), frame + HALF_WINDOW + 1)
        local = self.vessels[source].place("lip")
        lips = poses.translation[rows] + poses.rotation[rows] @ local
        runs = settled_runs(poses.times[rows], poses.valid[rows], poses.linked[rows])
        same = runs == runs[frame - rows.start]
        if runs[frame - rows.start] < 0 or int(same.sum()) < LEAST_SAMPLES:
            return np.zeros(3)
        return fitted(poses.times[rows][same], lips[same]).velocity(float(poses.times[frame]))


def _check(declared: Declaration, _scene: Scene) -> None:
    if set(declared.bodies("from")) == set(declared.bodies("into")) and len(declared.bodies("from")) == 1:
        raise declared.fail(f"{declared.bodies('from')[0]!r} pours into itself; name another vessel in into")


SPEC = EffectSpec(
    kind="pour",
    about="Liquid leaves a tilted vessel.",
    compute=compute,
    uses=("burette",),
    fields={
        "from": bodies("cylindrical vessels that may pour"),
        "into": bodies("vessels that may receive", required=False),
        "least_ml": number(
            "less than this in one go is booked and is no event", "mL", default=0.05, least=0.0,
            source="chosen by us: about a drop, which nobody calls a pour",
        ),
    },
    trigger="a vessel tilted beyond the angle at which its liquid reaches the lip",
    sources=(
        "volume kept: a cylinder cut by a plane through its lip (models/tilted.py), quasi-static: no inertia, no rate",
        "destination: free fall from the lip with the lip's velocity, standard gravity (CGPM 1901)",
        f"flows within {GAP_S} s are one: chosen by us",
    ),
    check=_check,
)  # fmt: skip

"""Each sentence about a fault is true: its predicate is held to verdicts, samples, shapes and reports.

What is sampled, how far bodies are apart and whether hulls meet is computed here by other means than in the product.
"""

import os
import re
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, cKDTree
from support.planted_sessions import planted_session

from cdcore import Verdict
from cdcore.protocol import counts_as_contact
from replay.auditing.loss import fraction_of
from replay.detection.detector_spec import parse_detector
from replay.document.fault_sentences import CAUSE_REASONS, noise_remark
from replay.engine import compute

BODY = r"[a-z]+"
PAIR = rf"(?P<a>{BODY}) and (?P<b>{BODY})"
SPAN = r"(?P<frames>[\d,]+) recorded frames? \((?P<long>[\d.,e+]+) ms\)"
WHEN = r"at (?P<when>[\d.]+) s"
OUTCOME = (
    rf"(?:(?P<never>\S+ never reported the contact of {BODY} and {BODY} at [\d.]+ s)"
    rf"|\S+ reported the contact of {BODY} and {BODY} at [\d.]+ s (?P<late>\d+) recorded frames? \([\d.e+]+ ms\) late"
    rf"|\S+ stopped reporting the contact of {BODY} and {BODY} at [\d.]+ s (?P<short>\d+) recorded frames? .* too early"
    rf"|\S+ reported no contact of {BODY} and {BODY} for (?P<gone>\d+) recorded frames? .*? at [\d.]+ s)"
)
GAP = r"the surfaces (?:are (?P<gap>[\d.]+) mm apart|do not meet)"


@dataclass
class Claim:
    """A fault of a detector in a run, and what the sentence about it says."""

    run: object
    label: str
    fault: object
    fields: dict

    @property
    def settings(self):
        return self.run.document.detectors[self.label].settings

    @property
    def name(self):
        return self.run.document.detectors[self.label].name

    @property
    def times(self):
        return self.run.assembly.motion.times

    @property
    def reported(self):
        return counts_as_contact(self.run.detections[self.label].verdict)[:, self.fault.pair]

    @property
    def truth(self):
        return counts_as_contact(self.run.detections["exact"].verdict)[:, self.fault.pair]

    @property
    def contact(self):
        return self.run.episodes["exact"][self.fault.contact - 1]

    def samples(self):
        """Frames in which the detector samples and both poses are known, walked tick by tick."""
        rate, frames, tick = self.settings["rate_hz"], [], -np.inf
        posed = self.run.assembly.motion.valid[:, self.run.assembly.pairs[self.fault.pair]].all(axis=1)
        for frame, time in enumerate(self.times.tolist()):
            now = np.inf if rate is None else np.floor((time - self.settings["sampling_offset_s"] + 1e-6) * rate)
            if rate is None or now > tick:
                tick = now
                frames += [frame] if posed[frame] else []
        return np.array(frames, dtype=int)

    def sampled_within(self):
        frames = self.samples()
        return frames[(frames >= self.fault.first) & (frames <= self.fault.last)]

    def corners(self, body, frame):
        number = self.run.assembly.names.index(body)
        motion, mesh = self.run.assembly.motion, self.run.assembly.bodies[number].mesh
        return mesh.vertices @ motion.rotations[frame, number].T + motion.translations[frame, number]

    def separated(self, margin=0.0):
        """Whether a plane has the hulls of both bodies on its sides, ``margin`` metres from each other at least."""
        first, other = (self.corners(body, self.fault.frame) for body in self.fault.bodies)
        return hulls_separate(first, other) > margin


def hulls_separate(first, other):
    """Metres by which the hulls of two sets of points are apart at least; below 0: no plane is between them."""
    directions = (first[:, None] - other).reshape(-1, 3)
    # The origin is outside the hull of all differences by its largest distance from a face's plane.
    return float(ConvexHull(directions).equations[:, 3].max())


def surfaces_at_most(claim):
    """An upper bound of the distance of two surfaces: that of many points of theirs."""
    points = []
    for body in claim.fault.bodies:
        number = claim.run.assembly.names.index(body)
        faces = claim.run.assembly.bodies[number].mesh.faces
        corners = claim.corners(body, claim.fault.frame)[faces]
        weights = np.array([(i, j, 12 - i - j) for i in range(13) for j in range(13 - i)]) / 12.0
        points.append(np.einsum("wk,fkd->fwd", weights, corners).reshape(-1, 3))
    return float(cKDTree(points[0]).query(points[1])[0].min())


def gap_holds(claim):
    """The gap that is said is no larger than that of points of the surfaces, and not much smaller."""
    if claim.fields.get("gap") is None:
        return np.isnan(claim.fault.metres)
    gap, above = float(claim.fields["gap"]), 1e3 * surfaces_at_most(claim)
    return gap <= above + 0.51 and above <= gap + 12.0 and not claim.truth[claim.fault.frame]


def outcome_holds(claim):
    """Whether the outcome of the contact is true: never reported, late, cut short, or not reported in these frames."""
    fault, contact, reported = claim.fault, claim.contact, claim.reported
    claimed = claim.fields
    if reported[fault.first : fault.last + 1].any():
        return False
    if claimed.get("never"):
        return not reported[contact.first : contact.last + 1].any()
    if claimed.get("late"):
        return fault.first == contact.first and reported[fault.last + 1] and int(claimed["late"]) == fault.frames
    if claimed.get("short"):
        return fault.last == contact.last and reported[fault.first - 1] and int(claimed["short"]) == fault.frames
    return int(claimed["gone"]) == fault.frames


def between_two_samples(claim):
    """The contact lies between two samples, and is shorter than the time between them that is said."""
    answer, contact, frames = claim.fields, claim.contact, claim.samples()
    step = float(answer["apart"] or answer["step"])
    lasted = 1e3 * (contact.end - contact.start)
    inside = ((frames >= contact.first) & (frames <= contact.last)).any()
    around = (frames < contact.first).any() and (frames > contact.last).any()
    usual = f"{1e3 / claim.settings['rate_hz']:.3g}"
    if inside or not around or float(answer["lasted"]) > step or answer["step"] != usual:
        return False
    if answer["apart"] and lasted < float(answer["step"]):
        return False
    return answer["lasted"] == (f"{lasted:.3g}" if lasted < 1000 else f"{lasted:,.0f}")


def late_by_less_than_a_step(claim):
    """The contact is reported after the miss, in which no sample lies, and which is no longer than a step."""
    long = float(claim.fields["long"])
    on_time = claim.fault.first == claim.contact.first and claim.reported[claim.fault.last + 1]
    return on_time and not len(claim.sampled_within()) and long <= float(claim.fields["step"]) + 0.5


def samples_around(claim):
    """No sample lies in the miss, and those around it are as far apart as is said."""
    frames = claim.samples()
    before, after = frames[frames < claim.fault.first], frames[frames > claim.fault.last]
    gap = 1e3 * (claim.times[after[0]] - claim.times[before[-1]])
    return outcome_holds(claim) and not len(claim.sampled_within()) and float(claim.fields["around"]) == pytest.approx(
        gap, rel=6e-3
    )  # fmt: skip


def not_sampled(claim):
    """So many frames of the miss as are said have no sample."""
    count = claim.fault.frames - len(claim.sampled_within())
    return outcome_holds(claim) and int(claim.fields["unsampled"]) == count > 0


def outer_sample(claim):
    """The first or last sample is at the time that is said, and none lies beyond the miss."""
    frames = claim.samples()
    other = frames[frames < claim.fault.first] if claim.fields["side"] == "last" else frames[frames > claim.fault.last]
    nearest = other[-1] if claim.fields["side"] == "last" else other[0]
    rest = frames > claim.fault.last if claim.fields["side"] == "last" else frames < claim.fault.first
    return not rest.any() and float(claim.fields["moment"]) == pytest.approx(claim.times[nearest], abs=6e-4)


def moved_figures(claim):
    """Moved by so many frames, so many are wrong; a contact that is moved out of the recording is wrong."""
    by = int(claim.fields["by"]) * (1 if claim.fields["direction"] == "earlier" else -1)
    reported, truth = claim.reported, claim.truth
    moved = np.zeros_like(truth)
    for frame in np.flatnonzero(reported):
        if 0 <= frame - by < len(truth):
            moved[frame - by] = True
    lost = sum(not 0 <= frame - by < len(truth) for frame in np.flatnonzero(reported))
    kept = slice(0, len(truth) - by) if by > 0 else slice(-by, None)
    wrong = int((moved != truth)[kept].sum()) + lost
    before = int((reported != truth).sum())
    numbers = tuple(int(claim.fields[name].replace(",", "")) for name in ("moved", "unmoved"))
    return numbers == (wrong, before) and wrong * 4 <= before


def report_of_contact_begins_late(claim):
    """Nothing is reported from the contact's begin to the end of the miss, and something later in it."""
    before = claim.reported[claim.contact.first : claim.fault.last + 1]
    return not before.any() and claim.reported[claim.fault.last + 1 : claim.contact.last + 1].any()


def report_of_contact_ends_early(claim):
    """The contact is reported before the miss."""
    return claim.reported[claim.contact.first : claim.fault.first].any()


def report_ends_late(claim):
    """A contact ended before the false one, and was reported until it."""
    return claim.truth[: claim.fault.first].any() and claim.reported[claim.fault.first - 1]


def report_starts_early(claim):
    """The report goes on after the false contact."""
    return claim.reported[claim.fault.last + 1]


def no_sample_within(claim):
    """Contact is reported in all these frames, in none of which the detector samples."""
    return not len(claim.sampled_within()) and claim.reported[claim.fault.first : claim.fault.last + 1].all()


def answer_of_last_sample(claim):
    """The frame is no sample, and the last one before it is at the time that is said."""
    frames = claim.samples()
    last = frames[frames <= claim.fault.frame]
    if claim.fields["sample"] is None:
        return not len(last)
    unsampled = claim.fault.frame not in frames
    return unsampled and gap_holds(claim) and float(claim.fields["sample"]) == pytest.approx(
        claim.times[last[-1]], abs=6e-4
    )  # fmt: skip


def in_hull(claim):
    """A corner of the other body is a convex sum of the corners of the one, and both surfaces are apart."""
    item = claim.corners(claim.fields["one"], claim.fault.frame)
    rows = np.vstack([item.T, np.ones(len(item))])
    inside = any(
        linprog(np.zeros(len(item)), A_eq=rows, b_eq=[*corner, 1.0]).success
        for corner in claim.corners(claim.fields["other"], claim.fault.frame)
    )
    return claim.settings["shape"] == "hull" and inside and gap_holds(claim)


def shapes_meet(claim):
    """Whether hulls or triangle meshes meet; other shapes are larger than hulls."""
    shape = claim.settings.get("shape", "hull")
    labels = {
        "hull": "convex hulls",
        "box": "boxes",
        "sphere": "spheres",
        "capsule": "capsules",
        "mesh": "triangle meshes",
        "compound": "convex pieces",
    }
    named = claim.fields["shape"] == ("colliders" if claim.name == "mujoco" else labels[shape])
    return named and gap_holds(claim) and (shape != "hull" or not claim.separated(1e-5))


def reach_of(claim):
    """Metres within which the detector reports contact, by its settings."""
    settings, name = claim.settings, claim.name
    if name == "bullet":
        sizes = [
            np.linalg.norm(np.ptp(claim.run.assembly.bodies[number].mesh.vertices, axis=0) / 2 + settings["margin_m"])
            for number in claim.run.assembly.pairs[claim.fault.pair]
        ]
        return 2 * settings["margin_m"] + 0.02 * min(sizes)
    return {"collider": 2 * settings.get("skin_m", 0.0), "rapier": settings.get("prediction_m", 0.0),
            "mujoco": settings.get("margin_m", 0.0)}[name]  # fmt: skip


def within_offset(claim):
    """The hulls or surfaces are no farther apart than the offset reaches, and the shapes themselves are apart."""
    reach = 1e3 * reach_of(claim)
    near = float(claim.fields["near"]) if claim.fields.get("near") else None
    right = float(claim.fields["reach"]) == pytest.approx(reach, rel=6e-3)
    shape = claim.settings.get("shape", "hull")
    if shape == "hull":
        right &= claim.separated(-1e-6)
        right &= not claim.separated(1e-3 * reach * 1.001 + 1e-4)
    if near is not None:
        right &= near <= reach + 0.05
        claim.fields["gap"] = claim.fields["near"]
    return right and gap_holds(claim)


def volumes_only(claim):
    """The verdict is only that bounding volumes overlap."""
    return claim.run.detections[claim.label].verdict[claim.fault.frame, claim.fault.pair] == Verdict.CANDIDATE


def contained_and_not_requested(claim):
    """One body is inside the other in as many frames as are said, and the detector was not asked for that."""
    verdict = claim.run.detections["exact"].verdict[claim.fault.first : claim.fault.last + 1, claim.fault.pair]
    # A search proves no surfaces disjoint, so that it never decides what is inside.
    asks = claim.settings.get("containment", False) and claim.settings.get("decide") != "search"
    return (verdict == Verdict.CONTAINED).sum() >= claim.fault.agreeing[0] and not asks


def no_step_within(claim):
    """No stamp of the reports lies in the time of the miss."""
    stamps = (np.array([item.time_ns for item in claim.run.session.live_contacts]) - claim.run.assembly.first_ns) / 1e9
    first, last = claim.times[[claim.fault.first, claim.fault.last]]
    return claim.name == "recorded" and not ((stamps >= first) & (stamps <= last)).any()


STAGES = {
    "one body is inside the other, and the detector does not test that": contained_and_not_requested,
    "no physics step of the engine falls into that time": no_step_within,
    "the colliders that stand for the meshes do not meet there":
        lambda claim: claim.name in ("collider", "bullet", "rapier", "mujoco"),
    "its bounding volumes do not meet there, so no triangle was tested": lambda claim: "qaco" in claim.name,
    "no pair of faces that meets is among those it samples": lambda claim: "qaco" in claim.name,
    "the search stopped at its budget without a hit; ten times the budget finds it":
        lambda claim: "qaco" in claim.name,
    "the search ended without a hit, and ten times the budget finds none either": lambda claim: "qaco" in claim.name,
}  # fmt: skip
"""Why a contact is lost in a stage -> whether the detector has it, and what of it can be seen from outside."""


def cause_of_frames(claim):
    """The examined frames are as many as are said, and the reason can be one of this detector."""
    examined, of = claim.fault.agreeing
    counted = claim.fields["examined"] is None if examined == of else int(claim.fields["examined"]) == examined
    return outcome_holds(claim) and examined > 0 and counted and STAGES[claim.fields["reason"]](claim)


REASON = "|".join(map(re.escape, CAUSE_REASONS["misses"].values()))
FROM = r"\S+ reports contact from (?P<reach>[\d.]+) mm on: its contact offset\."
MISSED = {
    rf"\S+ samples every (?P<step>[\d.]+) ms; the contact of {PAIR} {WHEN} lasted (?P<lasted>[\d.,]+) ms, between two "
    r"samples(?: (?P<apart>[\d.]+) ms apart)?\.": between_two_samples,
    rf"\S+ samples every (?P<step>[\d.]+) ms: it reported the contact of {PAIR} {WHEN} {SPAN} late\.":
        late_by_less_than_a_step,
    rf"{OUTCOME}: two of its samples are (?P<around>[\d.]+) ms apart there\.": samples_around,
    rf"{OUTCOME}: it took no sample in (?P<unsampled>\d+) of these frames\.": not_sampled,
    rf"{OUTCOME}: it took its (?P<side>first|last) sample at (?P<moment>[\d.]+) s\.": outer_sample,
    rf"{OUTCOME}: moved (?P<by>\d+) frames? (?P<direction>earlier|later), what it reports of this pair is wrong in "
    r"(?P<moved>[\d,]+) frames instead of (?P<unmoved>[\d,]+)\.": moved_figures,
    rf"{OUTCOME}: its report of this contact begins late\.": report_of_contact_begins_late,
    rf"{OUTCOME}: its report of this contact ends early\.": report_of_contact_ends_early,
    rf"{OUTCOME}: (?:in (?P<examined>\d+) of \d+ examined frames )?(?P<reason>{REASON})\.": cause_of_frames,
    rf"{OUTCOME}; nothing known about it explains this\.": outcome_holds,
}  # fmt: skip
"""Sentence about a miss -> its predicate."""

REPORTED = rf"\S+ reported contact of {PAIR} {WHEN} for {SPAN}; {GAP}"
FALSE = {
    rf"The convex hull of (?P<one>{BODY}) fills its hollow: (?P<other>{BODY}) is inside the hull"
    rf"(?:, still (?P<gap>[\d.]+) mm from the mesh,)? {WHEN}\.": in_hull,
    rf"{PAIR} are (?P<near>[\d.]+) mm apart {WHEN}; {FROM}": within_offset,
    rf"The .* of {PAIR} do not meet {WHEN}, and {GAP}; {FROM}": within_offset,
    rf"The (?P<shape>.*) of {PAIR} meet {WHEN}; {GAP}\.": shapes_meet,
    rf"Only the bounding volumes of {PAIR} overlap {WHEN}; {GAP}, and \S+ tests no triangle\.": volumes_only,
    rf"\S+ keeps its answer until its next sample: it reported contact of {PAIR} for {SPAN} {WHEN}, too long\.":
        no_sample_within,
    rf"At (?P<when>[\d.]+) s \S+ kept the answer of its last sample(?: at (?P<sample>[\d.]+) s)? about {PAIR}; {GAP}\.":
        answer_of_last_sample,
    rf"{REPORTED}: moved (?P<by>\d+) frames? (?P<direction>earlier|later), what it reports of this pair is wrong in "
    r"(?P<moved>[\d,]+) frames instead of (?P<unmoved>[\d,]+)\.": moved_figures,
    rf"{REPORTED}: its report of this contact ends late\.": report_ends_late,
    rf"{REPORTED}: its report of this contact starts early\.": report_starts_early,
    rf"{REPORTED}: no physics step of the engine came that could see them part\.": gap_holds,
    rf"{REPORTED}; nothing known about it explains this\.": gap_holds,
}  # fmt: skip
"""Sentence about a false contact -> its predicate."""


def in_millimetres(text):
    """The text with every length in millimetres; very small ones are printed in smaller units."""
    units = {"µm": 1e-3, "nm": 1e-6}
    return re.sub(r"([\d.]+) (µm|nm)\b", lambda result: f"{float(result[1]) * units[result[2]]:.9f} mm", text)


NOISE_MM = 3 * (2 / 3) ** 0.5 * 0.3
"""Three standard deviations of the distance of two trackers whose errors are 0.3 mm long, a third of that along it."""


def without_noise(why, fault):
    """The sentence without that on tracker noise, which stands where the contact is less deep than noise makes it."""
    match = re.search(r" It is ([\d.]+) mm deep: the noise of a tracker could have made it\.$", why)
    assert bool(match) == (0.0 < 1e3 * fault.depth <= NOISE_MM and not fault.depth_at_least), why
    if match is None:
        return why
    assert float(match[1]) == pytest.approx(1e3 * fault.depth, rel=0.01)
    return why[: match.start()]


@pytest.mark.parametrize(
    ("depth_mm", "at_least", "may_be_noise"),
    [
        pytest.param(NOISE_MM / 2, False, True, id="half as deep as noise makes it"),
        pytest.param(NOISE_MM / 2, True, False, id="that deep at least, so perhaps deeper"),
        pytest.param(NOISE_MM * 2, False, False, id="twice as deep as noise makes it"),
    ],
)
def test_only_shallow_contacts_of_known_depth_may_be_noise(depth_mm, at_least, may_be_noise):
    """A missed contact of this depth; ``at_least``: not all of it was searched, so that it may be deeper."""
    remark = noise_remark(depth_mm / 1000, at_least=at_least)
    assert ("the noise of a tracker could have made it" in remark) == may_be_noise
    assert (remark == "") != may_be_noise


def claims(run):
    """Every fault of every detector with the one form that its sentence has, and the predicate of that form."""
    for label in run.comparisons:
        for forms, faults in ((MISSED, run.misses[label]), (FALSE, run.false[label])):
            for fault in faults:
                why = without_noise(in_millimetres(fault.why), fault)
                matches = [(match, holds) for form, holds in forms.items() if (match := re.fullmatch(form, why))]
                assert len(matches) == 1, fault.why
                match, holds = matches[0]
                yield Claim(run, label, fault, match.groupdict()), holds


def fixes_hold(run, session, *, again):
    """No measured fix is the subject or as bad as it, its figures are those of what it names, and of a run with it."""
    ranks = {rank.label: rank for rank in run.ranking}
    for answer in run.answers:
        rank, fix = ranks[answer.label], answer.fix
        assert bool(answer.why) == (rank.loss > 0.0), answer
        if fix is None:
            continue
        if not fix.measured:
            assert "Measured on this session" not in fix.notes and not fix.change
            if fix.command.startswith("replay run"):
                spec = parse_detector("fix=" + fix.command.split('"')[1])
                assert str(spec) != str(parse_detector("fix=" + rank.setting))
            continue
        named = re.search(r"\((\S+)\)[.,]", fix.text)
        if fix.text.startswith("Sample every frame"):
            settings = run.document.detectors[answer.label].settings
            spec = (run.document.detectors[answer.label].name, settings | {"rate_hz": None})
            if again:
                (alone, _) = compute(session, detectors={"it": spec, "exact": "exact"}).ranking
                assert alone.loss < rank.loss and figures_of(fix) == figures_of_rank(alone)
        elif named and named[1] != run.oracle:
            other = ranks[named[1]]
            assert other.label != answer.label and other.loss < rank.loss
            assert figures_of(fix) == figures_of_rank(other)
            pieces = re.match(r"Up to (\d+) convex pieces", fix.text)
            if pieces:
                assert run.document.detectors[other.label].settings["pieces"] == int(pieces[1])


def figures_of(fix):
    """Largest counts missed and late, and the false share, as a fix prints those after it; what it leaves out is 0."""
    false = re.search(r"[fF]alse ([\d.]+) %(?: as before| -> ([\d.]+) %)", fix.change)
    largest = []
    for kind in ("missed", "late or cut short"):
        average = r"(?: \([\d.]+ -> [\d.]+ on average\))"
        count = r"((?:up to |\d+ to )?\d+)"
        changed = rf"(?: as before|{average}| -> {count})"
        printed = re.search(rf"(?i:{kind}) {count}(?: of [\d,]+)?{changed}", fix.change)
        assert printed or kind.split()[0] not in fix.change.lower() or "none missed or late" in fix.change
        after = (printed[2] or printed[1]) if printed else "0"
        largest.append(int(after.split()[-1]))
    return *largest, float(false[2] or false[1])


def figures_of_rank(rank):
    """Largest counts missed and late, and the false percentage, of a row of the ranking."""
    percent = 100 * fraction_of(rank.false)
    nearest = min(percent, 100 - percent)
    digits = max(0, 1 - int(np.floor(np.log10(nearest)))) if nearest > 0 else 0
    return rank.missed_counts[1], rank.late_counts[1], float(f"{percent:.{digits}f}")


def check_claims_and_fixes(seed, *, engines, again):
    """Fails unless each sentence on a fault of a planted session is true; how many there were."""
    planted = planted_session(seed, engines=engines)
    run = compute(planted.session, detectors=planted.detectors)
    count = 0
    for claim, holds in claims(run):
        assert holds(claim), (claim.fault.why, claim.label, claim.name, dict(claim.settings), claim.fault)
        count += 1
    fixes_hold(run, planted.session, again=again)
    return count


@pytest.mark.parametrize("seed", [8, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 6, 9))])
def test_sentences_and_fixes_of_a_planted_session_hold(seed):
    """A session and detectors with many kinds of faults are drawn from the seed.

    Each sentence on a fault must match one form of MISSED or FALSE, a regular expression, and the predicate beside that
    form, which computes again what the sentence says; each fix must have the figures of the detector that it names.
    """
    assert check_claims_and_fixes(seed, engines=False, again=False) > 0


@pytest.mark.slow
@pytest.mark.parametrize("first_seed", range(0, int(os.environ.get("PLANTED_SESSIONS", "30")), 10))
def test_sentences_and_fixes_of_planted_sessions_hold(first_seed):
    """Ten sessions as above, with physics engines as detectors, and each fix run again; they have over 20 faults."""
    pytest.importorskip("pybullet")
    seeds = range(1000 + first_seed, 1010 + first_seed)
    assert sum(check_claims_and_fixes(seed, engines=True, again=True) for seed in seeds) > 20

"""Random sessions for claims about detectors: hollow and solid bodies that meet and part, asked by many detectors.

Drawn from a seed: a jittered clock, lost poses, rates, contact offsets, convex pieces, searches with small budgets, and
an engine that reports in time, late, or at its own steps.
"""

from dataclasses import dataclass, replace

import numpy as np
from support.small_worlds import cube, framed

from replay.engine import compute
from sessions import MeshData, Session, Status
from sessions.model.event import LiveContact


def channel(width=0.08, length=0.06, wall=0.01):
    """A closed channel with a U for its section, open to +Y: its hull has a hollow."""
    w = h = width / 2
    inner, floor = w - wall, wall - h
    section = [(-w, -h), (w, -h), (w, h), (inner, h), (inner, floor), (-inner, floor), (-inner, h), (-w, h)]
    corners = [(x, y, z) for z in (-length / 2, length / 2) for x, y in section]
    cut = [(0, 1, 4), (1, 2, 3), (1, 3, 4), (0, 4, 5), (0, 5, 7), (5, 6, 7)]
    faces = [(a, c, b) for a, b, c in cut] + [(a + 8, b + 8, c + 8) for a, b, c in cut]
    for k in range(8):
        following = (k + 1) % 8
        faces += [(k, following, following + 8), (k, following + 8, k + 8)]
    return MeshData(corners, faces)


def rod(length=0.1, thick=0.008):
    """A thin closed box along Y."""
    box = cube(1.0)
    return MeshData(box.vertices * [thick, length, thick], box.faces)


SHAPES = {"channel": channel, "rod": rod, "block": lambda: cube(0.05), "crumb": lambda: cube(0.012)}
RATES = (11.0, 20.0, 33.0, 50.0, 90.0)
QUICK = (
    "collider[shape=hull{rate}{skin}]",
    "collider[shape=box{rate}{skin}]",
    "collider[shape=capsule{rate}{skin}]",
    "collider[shape=sphere{rate}]",
    "collider[shape=mesh{rate}{skin}]",
    "discrete[containment=true{rate}]",
    "discrete[containment=false{rate}]",
    "hybrid[containment=false]",
    "hybrid-qaco[budget=40]",
    "qaco[budget=30]",
    "sphere",
    "support.planted_detectors:Late",
    "support.planted_detectors:Dropping",
    "support.planted_detectors:FiveLate",
)
SLOW = (
    "collider[shape=compound,pieces=1{rate}{skin}]",
    "collider[shape=compound,pieces=4{rate}{skin}]",
    "collider[shape=compound,pieces=16{rate}{skin}]",
    "collider[shape=compound,pieces=32{rate}]",
    "bullet[margin_m={margin}{rate}]",
    "rapier[prediction_m={margin}{rate}]",
    "mujoco[margin_m={margin}{rate}]",
)


@dataclass(frozen=True)
class PlantedSession:
    """A session, the detectors to ask about it by label, and the oracle."""

    session: Session
    detectors: dict


def planted_session(seed, *, engines=False):
    """The session of a seed; ``engines``: with compounds and real engines among the detectors."""
    rng = np.random.default_rng([56, seed])
    stamps = np.cumsum(rng.uniform(0.6, 1.4, int(rng.integers(60, 160))) * 1e9 / rng.choice([45.0, 72.0, 90.0]))
    stamps = (stamps + rng.integers(0, 10**12)).astype(np.int64)
    names = ["channel", *rng.choice(["rod", "block", "crumb"], int(rng.integers(1, 3)), replace=False)]
    poses = [path(rng, stamps, moves=number > 0) for number in range(len(names))]
    positions, quaternions = (np.stack(part, axis=1) for part in zip(*poses, strict=True))
    status = np.where(np.isnan(positions).any(axis=2), Status.LOST, Status.VALID)
    posed = framed(stamps, status, np.nan_to_num(positions), quaternions, names)
    session = replace(posed, meshes={name: SHAPES[name]() for name in names})
    session = with_reports(rng, session)
    kinds = [*QUICK, *(SLOW if engines else ())]
    chosen = rng.choice(len(kinds), int(rng.integers(3, 6)), replace=False)
    detectors = {f"d{k}": detector(rng, kinds[k]) for k in chosen}
    if session.live_contacts:
        detectors["engine"] = "recorded"
    if engines and rng.random() < 0.4:
        # Alone, their figures were once taken for each other's.
        rate = f",rate_hz={rng.choice(RATES)}"
        detectors |= {f"u{n}": f"collider[shape=compound,pieces={n}{rate}]" for n in (1, 4, 16)}
    return PlantedSession(session, detectors)


def detector(rng, form):
    """A detector of a form, with or without a rate and a contact offset."""
    rate = f",rate_hz={rng.choice(RATES)}" if rng.random() < 0.7 else ""
    skin = f",skin_m={rng.choice([0.001, 0.004, 0.008])}" if rng.random() < 0.4 else ""
    return form.format(rate=rate, skin=skin, margin=rng.choice([0.0, 0.001, 0.005])).replace("[,", "[")


def path(rng, stamps, *, moves):
    """Positions (T, 3) and quaternions (T, 4) of a body that comes to the middle and leaves it, some poses lost."""
    seconds = (stamps - stamps[0]) / 1e9
    if not moves:
        return np.zeros((len(stamps), 3)), np.tile([0.0, 0.0, 0.0, 1.0], (len(stamps), 1))
    swing = np.sin(2 * np.pi * (rng.uniform(0.8, 3.0) * seconds + rng.random()))
    positions = 0.012 * rng.normal(size=3) + np.outer(swing, 0.09 * rng.normal(size=3))
    turns = np.column_stack(
        [0.2 * np.sin(seconds[:, None] * rng.uniform(1, 4, 3) + rng.random(3)), np.ones(len(seconds))]
    )
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    if rng.random() < 0.3:
        first = int(rng.integers(5, len(stamps) - 8))
        positions[first : first + int(rng.integers(1, 6))] = np.nan
    return positions, turns


def with_reports(rng, session):
    """The session, in half of the seeds with what an engine reports of its true contacts."""
    if rng.random() < 0.5:
        return session
    found = compute(session, detectors="exact", oracle="none", offline=True)
    delay, hertz = rng.choice([0.0, 0.0, 0.03]), rng.choice([0.0, 50.0, 30.0])
    reports = []
    for contact in found.episodes["exact"]:
        a, b = found.assembly.bodies_of(contact.pair)
        moments = np.array([contact.start, contact.end]) + rng.choice([0.0, 0.0, 0.04], 2)
        if hertz:
            moments = np.ceil(moments * hertz) / hertz
        if moments[0] < moments[1]:
            for seconds, phase in zip(moments + delay, ("enter", "exit"), strict=True):
                reports.append(LiveContact(found.assembly.first_ns + round(1e9 * seconds), a, b, phase))
    return replace(session, live_contacts=tuple(sorted(reports, key=lambda report: report.time_ns)))

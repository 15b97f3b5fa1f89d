"""Bodies of revolution of the bench, vessels and solids, from the rows of `turned.toml`."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from sessions.geometry.profile import (
    Stroke,
    level_holding,
    rounded_strokes,
    sampled_polyline,
    solve_rising,
    volume_below,
)
from sessions.geometry.rings import revolved_solid
from sessions.glassware.instrument import (
    GLASS,
    MILLILITRE,
    Cavity,
    Instrument,
    Opening,
    metres,
    rows,
    weighed_instrument,
)
from sessions.glassware.vessel import Foot, Revolved, Shape, Spout, revolved_vessel


def from_row(faces: int, *, name: str) -> Instrument:
    """Return the instrument that a row of `turned.toml` describes."""
    row = rows("turned.toml")[name]
    material = row.get("material", GLASS)
    sites = {site: (0.0, metres(y), 0.0) for site, y in row.get("sites", {}).items()}
    if "outline" in row:
        fewest = row["least_sections"]
        outline = sampled_polyline(
            _strokes(row["outline"]), round(min((faces / 4.0) ** 0.5 * row["points"], faces / 2.0 / fewest))
        )
        sections = max(fewest, round(faces / 2.0 / (len(outline) - 2)))
        return weighed_instrument(name, revolved_solid(outline, sections), row["tags"], material, sites=sites)
    capacity = row["millilitres"] * MILLILITRE
    shape = _shape(row)
    if "mark" in row:
        # A narrow neck has no room to correct a bulb that holds 1 % too little (9 mm of a 12 mm neck for 100 mL), so
        # the bulb is what is solved, its profile sampled as for so many faces.
        def missing(bulb: float) -> float:
            trial = _shape(row, bulb)
            inner = sampled_polyline(trial.strokes, trial.resolution(faces)[1])
            return volume_below(inner, metres(row["mark"])) - capacity

        shape = _shape(row, solve_rising(missing, *metres(row["bulb_between"])))
    revolved = revolved_vessel(shape, faces)
    if "tip_down" in row:
        return _tip_down(row, name, revolved, capacity)
    radius, height = revolved.inner[-1].tolist()
    cavity = Cavity(
        capacity_m3=capacity,
        floor_height=float(revolved.inner[0, 1]),
        mark_height=level_holding(revolved.inner, capacity),
        to_brim=revolved.brimful(),
        opening=Opening.upwards(radius, height, revolved.reach),
    )
    return weighed_instrument(name, revolved.mesh, row["tags"], material, cavity=cavity, sites=sites)


def _tip_down(row: dict[str, Any], name: str, revolved: Revolved, capacity: float) -> Instrument:
    """The vessel upside down: its rim is the tip, and liquid stands over it."""
    height = metres(row["tip_down"])
    over = np.diag([1.0, -1.0, 1.0, 1.0])
    over[1, 3] = height
    (radius, full), brim = revolved.inner[-1].tolist(), revolved.brimful()
    tip = height - full
    cavity = Cavity(
        capacity_m3=capacity,
        floor_height=tip,
        mark_height=height - level_holding(revolved.inner, brim.volume - capacity),
        to_brim=brim.transformed(over),
        opening=Opening(centre=(0.0, tip, 0.0), normal=(0.0, -1.0, 0.0), radius=radius, lip=(0.0, 0.0, 0.0)),
    )
    return weighed_instrument(name, revolved.mesh.transformed(over), row["tags"], cavity=cavity)


def _shape(row: dict[str, Any], bulb: float = 1.0) -> Shape:
    spout, foot = row.get("spout"), row.get("foot")
    return Shape(
        strokes=_strokes(row["inside"], bulb),
        wall=metres(row["wall"]),
        spout=spout
        and Spout(
            depth=metres(spout["depth"]), height=metres(spout["height"]), half_angle=np.radians(spout["half_angle_deg"])
        ),
        foot=foot and Foot(**{key: metres(value) for key, value in foot.items()}),
        open_below=row.get("open_below", False),
    )


def _strokes(corners: Sequence[Sequence[Any]], bulb: float = 1.0) -> list[Stroke]:
    """Strokes along rows of corners; the radius of a bulb in metres."""

    def radius(written: Any) -> Any:
        return float(written.removesuffix("bulb")) * bulb if isinstance(written, str) else metres(written)

    return rounded_strokes([(radius(r), *metres([y, *how[:1]]), *how[1:]) for r, y, *how in corners])

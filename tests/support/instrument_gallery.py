"""Draws every instrument in Rerun; ``python tests/support/instrument_gallery.py OUT.png`` makes the guide's picture."""

import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from replay.outputs.rerun_log.viewer import OpenViewer, start_viewer
from sessions.glassware.catalogue import make_instrument
from sessions.glassware.instrument import Instrument

ROWS = (
    ("burette", "stand", "pipette", "tripod", "alcohol_lamp", "wick_holder", "graduated_cylinder", "gas_jar",
     "delivery_tube"),
    ("beaker_600", "beaker_400", "beaker_250", "beaker_100", "beaker_50", "erlenmeyer_flask", "volumetric_flask",
     "reagent_bottle", "funnel"),
    ("test_tube_rack", "test_tube", "dropper", "stirring_rod", "evaporating_dish", "watch_glass", "gas_jar_cover",
     "rubber_stopper", "reagent_bottle_stopper", "burette_stopcock"),
    ("hand_left", "hand_right", "proxy_wand", "proxy_headset", "tongs", "wire_gauze"),
)  # fmt: skip
"""What stands beside what; the bench is left out, it is as wide as all of them."""

COLOURS = {
    "steel": (150, 155, 165), "wood": (170, 125, 80), "rubber": (70, 60, 60), "porcelain": (235, 232, 225),
    "tissue": (222, 178, 150), "plastic": (70, 75, 85), "laminate": (120, 120, 125),
}  # fmt: skip
GLASS = (150, 205, 240, 46)
BACKGROUND = (14, 18, 26)
LETTER, GAP, SHELF = 0.0086, 0.03, 0.075
SMOOTH = 0.75
"""Cosine of the angle up to which a corner is shaded round."""
TOASTS_GONE = 14.0
"""Seconds until the viewer's own messages have left the picture."""


def draw(path: Path, faces: int = 4000) -> None:
    """Write a recording of all rows."""
    stream = rr.RecordingStream("instrument gallery")
    stream.save(path)
    stream.log("/", rr.ViewCoordinates.RIGHT_HAND_Y_UP, static=True)
    y = 0.0
    for row in ROWS:
        y = _shelf(stream, [(name, make_instrument(name, faces)) for name in row], y)
    stream.set_time("session", duration=0.0)
    stream.log("title", rr.TextLog("the instruments of the bench"))
    camera = rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital, position=[0.0, y / 2 + 0.2, 1.86], look_target=[0, y / 2, 0], eye_up=[0, 1, 0]
    )
    view = rrb.Spatial3DView(
        origin="/", name="instruments", background=list(BACKGROUND), line_grid=False, eye_controls=camera
    )
    stream.send_blueprint(rrb.Blueprint(view, collapse_panels=True))
    stream.disconnect()


def _shelf(stream: rr.RecordingStream, things: list[tuple[str, Instrument]], y: float) -> float:
    sizes = [np.ptp(thing.mesh.vertices, axis=0) for _, thing in things]
    widths = [max(size[0], LETTER * len(name) + 0.015) for (name, _), size in zip(things, sizes, strict=True)]
    x = -(sum(widths) + GAP * (len(things) - 1)) / 2
    y -= max(size[1] for size in sizes) + SHELF
    for (name, thing), width in zip(things, widths, strict=True):
        low, high = thing.mesh.bounds
        place = [x + width / 2 - (low[0] + high[0]) / 2, y - low[1], 0.0]
        colour = GLASS if "glass" in thing.tags else (*COLOURS[thing.material], 255)
        corners, normals = _shaded(thing)
        mesh = rr.Mesh3D(vertex_positions=corners, vertex_normals=normals, albedo_factor=list(colour))
        stream.log(f"instruments/{name}", mesh, rr.Transform3D(translation=place), static=True)
        label = rr.Points3D([[x + width / 2, y - 0.028, 0]], radii=rr.Radius.ui_points(0.01),
                            labels=[name.replace("_", " ")], colors=[[225, 230, 235]], show_labels=True)  # fmt: skip
        stream.log(f"labels/{name}", label, static=True)
        x += width + GAP
    return y


def _shaded(thing: Instrument) -> tuple[np.ndarray, np.ndarray]:
    """Corners with normals that are round where the surface is and sharp at its edges."""
    faces, corners = thing.mesh.faces, thing.mesh.triangles
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    round_ = np.zeros_like(thing.mesh.vertices)
    for corner in range(3):
        np.add.at(round_, faces[:, corner], flat)
    round_ /= np.linalg.norm(round_, axis=1, keepdims=True) + 1e-30
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    smooth = np.einsum("fij,fj->fi", round_[faces], flat) > SMOOTH
    normals = np.where(smooth[..., None], round_[faces], flat[:, None])
    return corners.reshape(-1, 3), normals.reshape(-1, 3)


def opened(path: Path) -> OpenViewer:
    """The recording in a headless viewer."""
    viewer = start_viewer(headless=True, size=(1500, 1500))
    viewer.open(path)
    return viewer


def main(out: Path) -> None:
    """Draw, look, cut off the empty border."""
    import io

    from PIL import Image

    with TemporaryDirectory() as folder:
        draw(Path(folder) / "gallery.rrd")
        with opened(Path(folder) / "gallery.rrd") as viewer:
            time.sleep(TOASTS_GONE)
            picture = Image.open(io.BytesIO(viewer.screenshot(viewer.state().views[0]))).convert("RGB")
    seen = np.abs(np.asarray(picture).astype(int) - BACKGROUND).sum(axis=-1) > 30
    rows, columns = np.nonzero(seen)
    picture = picture.crop((columns.min() - 20, rows.min() - 20, columns.max() + 20, rows.max() + 20))
    picture.quantize(200).save(out, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))

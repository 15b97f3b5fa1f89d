"""Every instrument is drawn by Rerun, from its mesh and from the GLB that any viewer loads."""

import pytest
import rerun as rr
from support.headless import viewer_or_skip
from support.instrument_gallery import ROWS, draw, opened

from sessions.glassware.catalogue import INSTRUMENTS, make_instrument
from sessions.meshes.glb import mesh_to_glb


def test_the_gallery_shows_every_instrument_but_the_bench():
    shown = [name for row in ROWS for name in row]
    assert sorted(shown) == sorted(set(INSTRUMENTS) - {"bench"})


def seen(path):
    with viewer_or_skip(opened, path) as viewer:
        return [(view.name, view.reports) for view in viewer.state().views]


@pytest.mark.slow
def test_rerun_draws_the_gallery_without_a_complaint(tmp_path):
    draw(tmp_path / "gallery.rrd", faces=800)
    assert seen(tmp_path / "gallery.rrd") == [("instruments", [])]


@pytest.mark.slow
def test_rerun_loads_the_glb_of_every_instrument_without_a_complaint(tmp_path):
    stream = rr.RecordingStream("instruments as GLB")
    stream.save(tmp_path / "glb.rrd")
    for name in INSTRUMENTS:
        data = mesh_to_glb(make_instrument(name, 500).mesh, name)
        stream.log(name, rr.Asset3D(contents=data, media_type="model/gltf-binary"), static=True)
    stream.set_time("session", duration=0.0)
    stream.log("title", rr.TextLog("all of them"))
    stream.disconnect()
    views = seen(tmp_path / "glb.rrd")
    assert views and all(not reports for _, reports in views)

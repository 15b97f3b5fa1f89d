import subprocess
import sys

import pytest

import sessions.synthetic
from sessions.errors import SessionError
from sessions.synthetic.scenes import make_scene_session


def test_an_unknown_scene_is_refused_with_what_there_is():
    with pytest.raises(SessionError, match="bench-bumps"):
        make_scene_session("bench-lumps")


def test_a_scene_is_made_by_name_with_its_settings():
    session, truth = make_scene_session("bench-bumps", seed=3, noise="off", jitter="even", faces=600)
    assert (truth.name, truth.seed, truth.noise) == ("bench-bumps", 3, "off")
    assert session.scene.name == "bench-bumps"
    assert len(session.frames) == 5401


@pytest.mark.parametrize("name", sessions.synthetic.__all__)
def test_every_public_name_is_there(name):
    assert getattr(sessions.synthetic, name) is not None


def test_importing_the_package_loads_no_geometry():
    code = "import sys, sessions.synthetic; print(*[m for m in ('numpy', 'trimesh', 'scipy') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_an_unknown_name_is_refused_with_what_there_is():
    with pytest.raises(AttributeError, match="make_scene_session"):
        _ = sessions.synthetic.make_magic

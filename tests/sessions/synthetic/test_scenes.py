from __future__ import annotations

import pytest

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

"""A made-up session carries its scene as an author would have written it, and the scene is what that text says."""

from __future__ import annotations

from collections.abc import Sequence

from sessions.scene import Scene
from sessions.scene_toml import parse_scene, scene_to_toml


def with_text(scene: Scene, remarks: Sequence[str] = ()) -> Scene:
    """Return the scene as read from its own TOML, headed by remarks.

    Raises
    ------
    SceneError
        The scene names a body, tag or instrument that it does not have.
    """
    head = "".join(f"# {line}\n" for line in remarks)
    return parse_scene(f"{head}\n{scene_to_toml(scene)}" if head else scene_to_toml(scene), f"{scene.name}.toml")

"""Scenes of other programs: MJCF, URDF, glTF with physics."""

"""Scene files: TOML in, a scene and its meshes out."""

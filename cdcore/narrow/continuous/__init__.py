"""Between two recorded poses: when two meshes first meet, or a proof that they do not."""

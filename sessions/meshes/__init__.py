"""Meshes in files: GLB and other formats, and the axes and units they come in."""

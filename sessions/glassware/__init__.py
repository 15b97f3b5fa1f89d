"""Instruments of an inorganic chemistry bench, made from their dimensions: closed meshes with walls and cavities."""

"""Volumes that hold a body: spheres and boxes, each conservative."""

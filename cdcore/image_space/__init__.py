"""Layered depth images: solids compared ray by ray, without a pair of faces."""

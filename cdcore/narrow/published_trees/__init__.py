"""The classic bounding-volume trees (AABB, OBB, RAPID's, SOLID's): one search, four rows of ``TREE_KINDS``."""

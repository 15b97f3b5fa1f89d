"""Ways to put convex pieces in place of a mesh, each a row of one table; cut in processes of their own, and kept."""

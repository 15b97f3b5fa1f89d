"""GJK at the leaves of SOLID's tree, with a separating axis kept."""

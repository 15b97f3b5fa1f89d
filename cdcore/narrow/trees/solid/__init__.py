"""SOLID's tree in the body's frame, its six-axis test, and GJK at the leaves with a separating axis kept."""

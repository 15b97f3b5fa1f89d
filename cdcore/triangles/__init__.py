"""Two triangles: do they meet? A float filter with a proven bound first, exact integers where it cannot tell."""

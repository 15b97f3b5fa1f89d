"""A wrong answer of a run, shrunk to the smallest input that still gives it, and written as a test."""

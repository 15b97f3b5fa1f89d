"""Whole experiments: the paper's tables, hard cases, benchmarks, a class, two runs compared."""

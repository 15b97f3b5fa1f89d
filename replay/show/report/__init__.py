"""The report of a run as one page: for readers who never open Rerun. It reads a result and computes nothing new."""

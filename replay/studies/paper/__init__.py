"""The tables and figures of the paper, regenerated beside the printed values."""

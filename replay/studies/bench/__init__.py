"""How fast the detectors are: on the common workload, beside other engines, and as sessions grow."""

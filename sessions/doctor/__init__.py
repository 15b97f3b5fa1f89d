"""Whether a recording can be trusted: every fault a recording is known to have, named with body, span and cure."""

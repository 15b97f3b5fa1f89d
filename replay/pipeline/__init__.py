"""One run from session to result: engine, summary, scores, headline, gates."""

"""Rows of a tradeoff made by hand, and its front, found in a second way: nothing here comes from the product."""

CHECK = {"passes": 7, "ratio": 1.0, "low": 0.98, "high": 1.02, "tie": True, "widened": 1.0}
ABOUT = {
    "session": "s", "contacts": 18, "frames": 6, "seconds": 60.0, "bodies": 2, "pairs": 1, "oracle": "exact",
    "processor_share": 1.0, "machine": {"system": "Linux", "processor": "x", "cores": 2}, "reference": "exact",
    "live_frames": 6, "clock": CHECK, "time_limit": 20.0,
}  # fmt: skip


def price_row(label, ms, missed, late=0, false=0, *, spread=0.1, p99=None, **more):
    """A setting that takes ``ms`` a frame and gets so many of 18 contacts wrong; a count may be a range (low, high)."""
    counts = {}
    for name, count in {"missed": missed, "late": late, "false_contacts": false}.items():
        low, high = count if isinstance(count, tuple) else (count, count)
        counts |= {name: (low + high) / 2, f"{name}_smallest": low, f"{name}_largest": high}
    # Any order of losses will do for a front: here a contact missed, late or false costs the same.
    loss = sum(counts[name] for name in ("missed", "late", "false_contacts")) / 18
    return {
        "label": label, "settings": label, "detector": label, "line": "", "value": "", "rate_hz": None,
        "complete": False, "oracle": False, "contacts": 18, "contacts_undecided": 0,
        "contact_frames_undecided": 0, "offsets": 1, "not_reported": 0.0,
        "false": counts["false_contacts"] / 50, "loss": loss, **counts,
        "mean_ms": ms, "mean_low": None if spread is None else (1 - spread) * ms,
        "mean_high": None if spread is None else (1 + spread) * ms,
        "p99_ms": 2 * ms if p99 is None else p99, "p99_low": None, "p99_high": None,
        "passes": 1 if spread is None else 7,
        "frames": 6, "work": {"looks": 3}, "digest": "d", "prepare_seconds": 0.0, "front": False, **more,
    }  # fmt: skip


def surely_quicker(a, b):
    apart = None not in (a["mean_high"], b["mean_low"]) and a["mean_high"] < b["mean_low"]
    unknown = None in (a["mean_low"], b["mean_low"])
    return apart or (unknown and a["mean_ms"] < b["mean_ms"])


def front(rows):
    """Labels, most accurate first: the next is the first by accuracy that is surely quicker than the one before."""
    left = [row for row in rows if not row["contact_frames_undecided"]]
    labels, last = [], None
    for least in sorted({row["loss"] for row in left}):
        alike = [row for row in left if row["loss"] == least]
        quickest = sorted(alike, key=lambda row: row["mean_ms"])[0]
        tied = [row for row in alike if row is quickest or not surely_quicker(quickest, row)]
        best = sorted(tied, key=lambda row: not row["complete"])[0]
        if last is None or surely_quicker(best, last):
            labels.append(best["label"])
            last = best
    return labels[::-1]

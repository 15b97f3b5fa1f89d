"""Rows of a tradeoff made by hand, and what its tool says of them: front, ties and advice, recomputed from the table.

Nothing here comes from the product: it is a second way to the same answers.
"""

COLUMNS = {"live": ("p99_ms", "p99_low", "p99_high"), "offline": ("ms_per_frame", "ms_low", "ms_high")}
BUDGETS = {60: 1000 / 60, 72: 1000 / 72, 90: 1000 / 90, 120: 1000 / 120}

CHECK = {"passes": 7, "ratio": 1.0, "low": 0.98, "high": 1.02, "tie": True, "widened": 1.0}
ABOUT = {
    "session": "s", "contacts": 3, "frames": 6, "seconds": 0.06, "bodies": 2, "pairs": 1, "oracle": "exact",
    "processor_share": 0.5, "machine": {"system": "Linux", "processor": "x", "cores": 2}, "reference": "exact",
    "live_frames": 6, "clock": {"live": CHECK, "offline": CHECK},
}  # fmt: skip


def price_row(label, ms, lost, *, live=None, spread=0.1, precision=1.0, **more):
    """A setting that takes ``ms`` a frame offline and ``live`` at its p99, and loses so many of 18 contacts."""

    def ends(value, names):
        known = value is not None and spread is not None
        wide = (value - spread * value, value + spread * value) if known else (None, None)
        return dict(zip(names, (value, *wide), strict=True))

    missed = lost / 18
    return {
        "label": label, "detector": label, "line": label, "axis": "as it comes", "value": "", "oracle": False,
        **ends(ms, COLUMNS["offline"]), **ends(live, COLUMNS["live"]), "mean_ms": live,
        "seconds_per_minute": 5.4 * ms, "passes": 7,
        "live_passes": 0 if live is None else 7, "online": live is not None, "over_share": 0.0, "complete": False,
        "simplicity": 0, "containment": True, "contacts": 18, "contacts_lost": lost, "lost_low": 0.9 * lost,
        "lost_high": min(18.0, 3.2 + lost), "phases": 1, "missed": missed, "missed_low": missed / 2,
        "missed_high": min(1.0, missed * 2), "precision": precision, "face_recall": None, "work": {"looks": 3},
        "front": False, "front_online": False, **more,
    }  # fmt: skip


def may(row):
    """Whether its reports are true more often than not, and it left no contact undecided."""
    return row["precision"] is not None and row["precision"] >= 0.5 and not row.get("contact_frames_undecided")


def overlap(one, two, kind):
    _, low, high = COLUMNS[kind]
    if None in (one[low], one[high], two[low], two[high]):
        return True
    return max(one[low], two[low]) <= min(one[high], two[high])


def chosen(rows, kind):
    """Of rows, the one that is named: the quickest, or what ties with it and is better, complete, or simpler."""
    first = sorted(rows, key=lambda row: row[COLUMNS[kind][0]])[0]
    some = [row for row in rows if overlap(row, first, kind)]
    for key in ("contacts_lost", lambda row: not row["complete"], "simplicity"):
        value = key if callable(key) else (lambda row, key=key: row[key])
        least = min(value(row) for row in some)
        some = [row for row in some if value(row) == least]
    return some[0]


def front(rows, kind):
    """Labels: named one after the other, each among the rows that lose fewer contacts than the one before."""
    left = [row for row in rows if may(row) and row[COLUMNS[kind][0]] is not None]
    labels = []
    while left:
        one = chosen(left, kind)
        labels.append(one["label"])
        left = [row for row in left if row["contacts_lost"] < one["contacts_lost"]]
    return labels


def advised(rows):
    """Frame rate -> the label to take, or ``None``."""
    found = {}
    for rate, budget in BUDGETS.items():
        fits = [row for row in rows if row["p99_high"] is not None and row["p99_high"] <= budget]
        found[rate] = (front(fits, "live") or [None])[-1]
    return found

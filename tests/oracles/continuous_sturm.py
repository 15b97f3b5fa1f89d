"""When a point first meets a triangle, or an edge an edge, while all corners move along lines: in whole numbers, by
Sturm's theorem.

Shares no step with the core: no boxes, no directions, no halving of the way, no rounding. Coordinates are integers;
times run from 0 to 1, both ends included. A time is told as a pair of fractions that holds it, equal where it is exact.
"""

from fractions import Fraction
from itertools import pairwise, product

WIDTH = Fraction(1, 2**60)
"""Width to which a time of contact is narrowed."""


# polynomials: coefficients from the constant one up, without trailing zeros; [] is zero


def trimmed(p):
    while p and p[-1] == 0:
        p = p[:-1]
    return p


def plus(p, q):
    size = max(len(p), len(q))
    return trimmed([(p[k] if k < len(p) else 0) + (q[k] if k < len(q) else 0) for k in range(size)])


def minus(p, q):
    return plus(p, [-c for c in q])


def times(p, q):
    if not p or not q:
        return []
    out = [0] * (len(p) + len(q) - 1)
    for (i, a), (j, b) in product(enumerate(p), enumerate(q)):
        out[i + j] += a * b
    return trimmed(out)


def value(p, at):
    total = Fraction(0)
    for c in reversed(p):
        total = total * at + c
    return total


def remainder(p, q):
    p = [Fraction(c) for c in p]
    while len(p) >= len(q):
        factor = p[-1] / q[-1]
        p = trimmed([c - factor * q[k - len(p) + len(q)] if k >= len(p) - len(q) else c for k, c in enumerate(p)][:-1])
    return p


def quotient(p, q):
    p, out = [Fraction(c) for c in p], [Fraction(0)] * (len(p) - len(q) + 1)
    while len(p) >= len(q):
        factor, shift = p[-1] / q[-1], len(p) - len(q)
        out[shift] = factor
        p = trimmed([c - factor * q[k - shift] if k >= shift else c for k, c in enumerate(p)][:-1])
    return out


def common(p, q):
    while q:
        p, q = q, remainder(p, q)
    return [Fraction(c) / p[-1] for c in p]


def slope(p):
    return trimmed([k * c for k, c in enumerate(p)][1:])


def chain_of(p):
    chain = [p, slope(p)]
    while chain[-1]:
        chain.append([-c for c in remainder(chain[-2], chain[-1])])
    return chain[:-1]


def changes(chain, at):
    signs = [v for v in (value(p, at) for p in chain) if v != 0]
    return sum((a < 0) != (b < 0) for a, b in pairwise(signs))


class Root:
    """A root of a square-free polynomial, alone in (low, high]; ``low == high`` where it is known exactly."""

    def __init__(self, p, low, high):
        self.p, self.low, self.high = p, low, high
        self.chain = chain_of(p)

    def halve(self):
        if self.low == self.high:
            return
        if value(self.p, self.high) == 0:
            self.low = self.high
            return
        middle = (self.low + self.high) / 2
        if changes(self.chain, self.low) - changes(self.chain, middle) == 1:
            self.high = middle
        else:
            self.low = middle

    def sign(self, g):
        """Sign of another polynomial at the root."""
        if not g:
            return 0
        shared = common(self.p, g)
        if len(shared) > 1 and self.holds(shared):
            return 0
        while self.low != self.high and (value(g, self.low) == 0 or self.holds(g)):
            self.halve()
        at = value(g, self.high)
        return (at > 0) - (at < 0)

    def holds(self, g):
        """Whether a polynomial has a root in (low, high], or at the root itself where it is known."""
        if self.low == self.high:
            return value(g, self.high) == 0
        free = quotient(g, common(g, slope(g))) if len(g) > 1 else g
        chain = chain_of(free) if len(free) > 1 else [free]
        return changes(chain, self.low) != changes(chain, self.high)

    def narrowed(self):
        while self.high - self.low > WIDTH:
            self.halve()
        return self.low, self.high


def roots(p):
    """Roots of a polynomial that is not zero in [0, 1], in order."""
    found = []
    if value(p, 0) == 0:
        found.append(Root([0, 1], Fraction(0), Fraction(0)))
    if len(p) < 2:
        return found
    free = quotient(p, common(p, slope(p)))
    if len(free) < 2:
        return found
    chain = chain_of(free)

    def isolate(low, high):
        count = changes(chain, low) - changes(chain, high)
        if count == 1:
            found.append(Root(free, low, high))
        elif count > 1:
            middle = (low + high) / 2
            isolate(low, middle)
            isolate(middle, high)

    isolate(Fraction(0), Fraction(1))
    return found


# vectors of polynomials


def sub(a, b):
    return [minus(x, y) for x, y in zip(a, b, strict=True)]


def dot(a, b):
    out = []
    for x, y in zip(a, b, strict=True):
        out = plus(out, times(x, y))
    return out


def cross(a, b):
    return [minus(times(a[(k + 1) % 3], b[(k + 2) % 3]), times(a[(k + 2) % 3], b[(k + 1) % 3])) for k in range(3)]


def moving(before, after):
    """A corner on its way, from integer triples."""
    return [trimmed([int(a), int(b) - int(a)]) for a, b in zip(before, after, strict=True)]


def on_edge(root, q, x, y):
    """Whether point q lies on the closed edge xy at a root."""
    if any(root.sign(c) != 0 for c in cross(sub(y, x), sub(q, x))):
        return False
    return root.sign(dot(sub(q, x), sub(q, y))) <= 0


def earliest(found, boundaries, touches):
    """The first time at which ``touches`` holds among the roots of the contact polynomial, or where it vanishes always,
    among those of the boundaries and both ends.
    """
    if found:
        candidates = roots(found)
    else:
        candidates = [Root([0, 1], Fraction(0), Fraction(0)), Root([-1, 1], Fraction(1), Fraction(1))]
        candidates += [root for p in boundaries if p for root in roots(p)]
    times_ = [root.narrowed() for root in candidates if touches(root)]
    return min(times_, default=None)


def point_face(p, a, b, c):
    """When a moving point first meets a moving face, ``None`` if never; corners as ``moving`` makes them."""
    e1, e2, r = sub(b, a), sub(c, a), sub(p, a)
    n = cross(e1, e2)
    nn, wc, wb = dot(n, n), dot(cross(e1, r), n), dot(cross(r, e2), n)
    wa = minus(minus(nn, wb), wc)
    edges = [(a, b), (b, c), (c, a)]

    def touches(root):
        if root.sign(nn) > 0:
            return all(root.sign(w) >= 0 for w in (wa, wb, wc))
        return any(on_edge(root, p, x, y) for x, y in edges)

    boundaries = [wa, wb, wc, nn, *edge_boundaries([(p, edge) for edge in edges], nn)]
    return earliest(dot(r, n), boundaries, touches)


def edge_edge(a0, a1, b0, b1):
    """When two moving edges first meet, ``None`` if never."""
    u, v, w = sub(a1, a0), sub(b1, b0), sub(b0, a0)
    n = cross(u, v)
    nn, s, t = dot(n, n), dot(cross(w, v), n), dot(cross(w, u), n)
    ends = [(a0, (b0, b1)), (a1, (b0, b1)), (b0, (a0, a1)), (b1, (a0, a1))]

    def touches(root):
        if root.sign(nn) > 0:
            return all(root.sign(g) >= 0 for g in (s, t, minus(nn, s), minus(nn, t)))
        return any(on_edge(root, q, x, y) for q, (x, y) in ends)

    boundaries = [s, t, nn, minus(nn, s), minus(nn, t), *edge_boundaries(ends, nn)]
    return earliest(dot(w, n), boundaries, touches)


def edge_boundaries(ends, nn):
    out = [dot(sub(q, x), sub(q, y)) for q, (x, y) in ends]
    if not nn:
        out += [c for q, (x, y) in ends for c in cross(sub(y, x), sub(q, x))]
    return out


def first_meeting(before_a, after_a, before_b, after_b):
    """When two faces first meet, apart at the start: integer corners (3, 3) at both ends; ``None`` if never.

    Faces that are apart meet first with a corner on a face or an edge on an edge.
    """
    a = [moving(x, y) for x, y in zip(before_a, after_a, strict=True)]
    b = [moving(x, y) for x, y in zip(before_b, after_b, strict=True)]
    found = [point_face(p, *b) for p in a] + [point_face(p, *a) for p in b]
    for i, j in product(range(3), range(3)):
        found.append(edge_edge(a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3]))
    return min((one for one in found if one is not None), default=None)

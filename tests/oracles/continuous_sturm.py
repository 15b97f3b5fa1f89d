"""When a point first meets a triangle, or an edge an edge, while all corners move along lines: in whole numbers, by
Sturm's theorem.

Shares no step with the core: no boxes, no directions, no halving of the way, no rounding. Coordinates are integers;
times run from 0 to 1, both ends included. A time is told as a pair of fractions that holds it, equal where it is exact.
"""

from fractions import Fraction
from functools import reduce
from itertools import pairwise, product, zip_longest
from math import gcd

import numpy as np
from numpy.polynomial.polynomial import polyder

WIDTH = Fraction(1, 2**60)
"""Width to which a time of contact is narrowed."""


# polynomials: whole numbers from the constant coefficient up, without trailing zeros; a positive factor counts for
# nothing


def polynomial(*coefficients):
    """A polynomial by its coefficients, the constant first."""
    return np.array(coefficients, dtype=object)


def trimmed(numbers):
    """A polynomial without leading zeros."""
    while numbers and numbers[-1] == 0:
        numbers.pop()
    return polynomial(*numbers) if numbers else polynomial(0)


# Those of numpy look for a common type and trim both arguments each time.


def polyadd(p, q):
    """The sum of two polynomials."""
    return trimmed([a + b for a, b in zip_longest(p.tolist(), q.tolist(), fillvalue=0)])


def polysub(p, q):
    """The difference of two polynomials."""
    return trimmed([a - b for a, b in zip_longest(p.tolist(), q.tolist(), fillvalue=0)])


def polymul(p, q):
    """The product of two polynomials."""
    return trimmed(np.convolve(p, q).tolist())


def divided(p, q):
    """Quotient and remainder, each times some positive number, by which all is multiplied so that nothing is broken."""
    rest, below, quotient = p.tolist(), q[:-1].tolist(), []
    size, rotation = abs(q[-1]), 1 if q[-1] > 0 else -1
    while len(rest) > len(below):
        top = rotation * rest.pop()
        rest, quotient = [size * c for c in rest], [top, *(size * c for c in quotient)]
        for k, c in enumerate(below, len(rest) - len(below)):
            rest[k] -= top * c
    return shortest(quotient), shortest(rest)


def shortest(numbers):
    """A polynomial with the same roots and the smallest whole coefficients."""
    shared = gcd(*numbers) or 1
    return trimmed([c // shared for c in numbers])


def value(p, at):
    """A positive multiple of the value at a fraction."""
    total, scale, top, bottom = 0, 1, at.numerator, at.denominator
    for c in p[::-1].tolist():
        total = total * top + c * scale
        scale *= bottom
    return total


def common(p, q):
    """The greatest common divisor of two polynomials."""
    while q.any():
        p, q = q, divided(p, q)[1]
    return p


def square_free(p):
    """A polynomial with the same roots, each once."""
    return divided(p, common(p, polyder(p)))[0]


def sturm_chain(p):
    """Sturm's chain of the square-free part."""
    free = square_free(p)
    chain = [free, polyder(free)]
    while chain[-1].any():
        chain.append(-divided(chain[-2], chain[-1])[1])
    return chain[:-1]


def changes(chain, at):
    """How often the sign changes along a Sturm chain at a place."""
    signs = [v for v in (value(p, at) for p in chain) if v != 0]
    return sum((a < 0) != (b < 0) for a, b in pairwise(signs))


class Root:
    """A root of a square-free polynomial, alone in (lower, upper]; ``lower == upper`` where it is known exactly."""

    def __init__(self, p, lower, upper):
        self.p, self.lower, self.upper = p, lower, upper
        self.above = value(p, upper)
        if self.above == 0:
            self.lower = upper

    def halve(self):
        if self.lower == self.upper:
            return
        middle = (self.lower + self.upper) / 2
        at = value(self.p, middle)
        if at == 0:
            self.lower = self.upper = middle
        elif (at < 0) == (self.above < 0):
            self.upper = middle
        else:
            self.lower = middle

    def sign(self, g):
        """Sign of another polynomial at the root."""
        if not g.any():
            return 0
        shared = common(self.p, g)
        if len(shared) > 1 and self.holds(shared, sturm_chain(shared)):
            return 0
        chain = sturm_chain(g)
        while self.lower != self.upper and (value(g, self.lower) == 0 or self.holds(g, chain)):
            self.halve()
        at = value(g, self.upper)
        return (at > 0) - (at < 0)

    def holds(self, g, chain):
        """Whether a polynomial has a root in (lower, upper], or at the root itself where it is known."""
        if self.lower == self.upper:
            return value(g, self.upper) == 0
        return changes(chain, self.lower) != changes(chain, self.upper)

    def narrowed(self):
        while self.upper - self.lower > WIDTH:
            self.halve()
        return self.lower, self.upper


def roots(p):
    """Roots of a polynomial that is not zero in [0, 1], in order."""
    result = []
    if value(p, 0) == 0:
        result.append(Root(polynomial(0, 1), Fraction(0), Fraction(0)))
    if len(p) < 2:
        return result
    chain = sturm_chain(p)

    def isolate(lower, upper):
        count = changes(chain, lower) - changes(chain, upper)
        if count == 1:
            result.append(Root(chain[0], lower, upper))
        elif count > 1:
            middle = (lower + upper) / 2
            isolate(lower, middle)
            isolate(middle, upper)

    isolate(Fraction(0), Fraction(1))
    return result


# vectors of polynomials


def sub(a, b):
    """The difference of two vectors of polynomials."""
    return [polysub(x, y) for x, y in zip(a, b, strict=True)]


def dot(a, b):
    """The scalar product of two vectors of polynomials."""
    return reduce(polyadd, map(polymul, a, b))


def cross(a, b):
    """The cross product of two vectors of polynomials."""
    return [polysub(polymul(a[(k + 1) % 3], b[(k + 2) % 3]), polymul(a[(k + 2) % 3], b[(k + 1) % 3])) for k in range(3)]


def moving(before, after):
    """A corner on its way, from integer triples."""
    return [polyadd(polynomial(int(a)), polynomial(0, int(b) - int(a))) for a, b in zip(before, after, strict=True)]


def on_edge(root, q, x, y):
    """Whether point q lies on the closed edge xy at a root."""
    if any(root.sign(c) != 0 for c in cross(sub(y, x), sub(q, x))):
        return False
    return root.sign(dot(sub(q, x), sub(q, y))) <= 0


def earliest(result, boundaries, touches):
    """The first time at which ``touches`` holds among the roots of the contact polynomial, or where it vanishes always,
    among those of the boundaries and both ends.
    """
    if result.any():
        candidates = roots(result)
    else:
        candidates = [Root(polynomial(-end, 1), Fraction(end), Fraction(end)) for end in (0, 1)]
        candidates += [root for p in boundaries if p.any() for root in roots(p)]
    times = (root.narrowed() for root in candidates if touches(root))
    return next(times, None) if result.any() else min(times, default=None)


def point_face(p, a, b, c):
    """When a moving point first meets a moving face, ``None`` if never; corners as ``moving`` makes them."""
    e1, e2, r = sub(b, a), sub(c, a), sub(p, a)
    n = cross(e1, e2)
    nn, wc, wb = dot(n, n), dot(cross(e1, r), n), dot(cross(r, e2), n)
    wa = polysub(polysub(nn, wb), wc)
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
            return all(root.sign(g) >= 0 for g in (s, t, polysub(nn, s), polysub(nn, t)))
        return any(on_edge(root, q, x, y) for q, (x, y) in ends)

    boundaries = [s, t, nn, polysub(nn, s), polysub(nn, t), *edge_boundaries(ends, nn)]
    return earliest(dot(w, n), boundaries, touches)


def edge_boundaries(ends, nn):
    """Polynomials whose signs say whether points are between the ends of their edges."""
    out = [dot(sub(q, x), sub(q, y)) for q, (x, y) in ends]
    if not nn.any():
        out += [c for q, (x, y) in ends for c in cross(sub(y, x), sub(q, x))]
    return out


def first_meeting(before_a, after_a, before_b, after_b):
    """When two faces first meet, apart at the start: integer corners (3, 3) at both ends; ``None`` if never.

    Faces that are apart meet first with a corner on a face or an edge on an edge.
    """
    a = [moving(x, y) for x, y in zip(before_a, after_a, strict=True)]
    b = [moving(x, y) for x, y in zip(before_b, after_b, strict=True)]
    result = [point_face(p, *b) for p in a] + [point_face(p, *a) for p in b]
    for i, j in product(range(3), range(3)):
        result.append(edge_edge(a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3]))
    return min((item for item in result if item is not None), default=None)

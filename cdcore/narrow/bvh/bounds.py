"""How far float64 arithmetic in a relative frame may lie from the reference vertices; every dismissal keeps that
distance.

**Claim.** Let S = |A| + |B| + |t_A| + |t_B|, with |A| the largest distance of a corner of A from A's origin and t the
translations, and d = delta_A + delta_B, with delta the Frobenius norm of R^T R - I. A pair of node boxes, a box and a
face, or two faces that the kernels find apart along some direction by more than ``pad = (POSITION_ULPS u + 8 d) S`` are
disjoint in the reference vertices, ``x' = ((r00 x + r01 y) + r02 z) + t0`` in float64.

**Why.** Take the reference vertices back to B's frame exactly, q = R_B^-1 (x' - t_B). This is affine with positive
determinant, so it keeps *disjoint*. With u = 2^-53, and |R p| <= (1 + d) |p|:

====================================================================  ==========================
what                                                                   displaces q by at most
====================================================================  ==========================
rounding of x' itself, A and B (7 u (|p| + |t|) each, SPEC section 4)  15 u S
using R_B^T for R_B^-1                                                 2 d S
rounding of R_B^T R_A (3 products, 2 sums) applied to a corner         10 u S
rounding of R_B^T (t_A - t_B)                                          9 u S
box centres, axes, extents and leaf corners of both trees, built once  2 x 40 u S
axes of a box not exactly orthonormal (a few u), node and leaf frames  2 x 24 u S
rotating a centre or corner into the box or leaf frame, with or
without fused multiply-add                                             30 u S
a direction's length above 1, dots with it, range of a face            40 u S
====================================================================  ==========================

Together below 250 u S + 3 d S; the pad is twice that. It is 6e-14 m on a laboratory bench and 6e-8 m at a distance of
1,000 km; a pad too large costs exact tests, never an answer.

**Orientation within a block.** Box radii are taken at the block's middle frame m. In frame l a corner of A lies off
that by at most |R_l - R_m|_2 times its distance from the box centre. For two rotations the norm is the Frobenius norm
over sqrt 2 (their difference has rank 2 and equal singular values); ``chord`` is that, for the relative rotations,
rounded up.

**Certain signs.** A difference of two corners in a leaf's box frame lies within the pad of that of the reference
vertices, taken there by a map that keeps all orientations or turns all round, which the test of two faces cannot tell
apart. So a determinant of three differences, all below X, is off by at most 3 pad X^2. It is computed from differences
of corners, each rounded once: 49 u X^3 (``cdcore.triangles.filter``). The bound is over twice the sum.
"""

from __future__ import annotations

from typing import Final, TypeVar

from cdcore.numerics import FloatArray

Real = TypeVar("Real", float, FloatArray)

ROUNDOFF: Final = 2.0**-53
POSITION_ULPS: Final = 512.0
"""Twice the sum of the table above."""
SKEW_FACTOR: Final = 8.0
"""Twice what a rotation off orthonormal by delta adds, rounded up."""
CHORD_SLACK: Final = 1.0 + 2.0**-40
"""Covers the rounding of the chord, relative to it; its absolute part (the rotations' own rounding) is in the pad."""
SIGN_PADS: Final = 6.0
SIGN_ULPS: Final = 256.0
"""A sign is certain if the determinant is above X^2 (SIGN_PADS pad + SIGN_ULPS u X)."""
TINY: Final = 1e-250
"""A determinant that small may have lost terms to underflow: undecided."""
EDGE_SLACK: Final = 1.0 + 1e-5
"""Placing a face lengthens its edges by less than this and the pad: rotations are orthonormal to LARGEST_SKEW."""
LARGEST_SIZE: Final = 1e75
"""Sizes S up to this keep every product of the kernels finite; above it the exhaustive path answers."""
SMALLEST_SIZE: Final = 1e-100
"""Sizes S from this on keep squares of a pad from underflow; below it the exhaustive path answers."""
LARGEST_SKEW: Final = 1e-6
"""Rotations further off orthonormal than this do not reach the kernels."""


def position_pad(size: Real, skew: Real) -> Real:
    """The distance, metres, that a dismissal keeps for bodies of joint size S and joint skew delta_A + delta_B."""
    return (POSITION_ULPS * ROUNDOFF + SKEW_FACTOR * skew) * size

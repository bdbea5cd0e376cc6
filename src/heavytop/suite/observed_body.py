"""Bodies of trajectory files: in the numbers of a format, and in principal axes.

A body whose principal axes are irrational is turned by a rational rotation next to them; what is left of the tensor off
its diagonal is 2^-bits of the largest moment, 160 bits below the format.
"""

from __future__ import annotations

from fractions import Fraction

from heavytop.precision import Precision, round_to
from heavytop.top.bodies import Body
from heavytop.top.heavy_top import HeavyTop, Vector
from heavytop.top.principal import IDENTITY, principal_axes

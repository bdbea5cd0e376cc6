"""Bodies out of files of robots: whether a tensor is that of a body, and which slip in it makes it one."""

from heavytop.feature import Feature

FEATURE = Feature(__name__, commands=("command",))

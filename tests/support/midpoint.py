"""An integrator in a file of its own, as somebody may write it: fifty steps of the midpoint rule to each time."""

from __future__ import annotations

MIDPOINT = """
def {name}(given):
    field, y, t, states = given.system.field, given.start.copy(), 0.0, []
    for end in given.times:
        h = (end - t) / 50
        for _ in range(50):
            half = y + [h / 2 * k for k in field(given.parameters, y)]
            y = y + [h * k for k in field(given.parameters, half)]
        t = end
        states.append(y)
    return Solved(states, t, 50 * len(given.times))
"""

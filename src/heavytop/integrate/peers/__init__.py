"""Alternatives to heyoka with the same call; each is imported at its first use.

A peer is a callable

    peer(top, start, times, precision, *, system, tolerance, xi) -> Trajectory

with the arguments of :func:`heavytop.integrate.heyoka.motions.propagate`; ``tolerance`` is exact, relative and
absolute, None for the best that the peer offers; a peer with fixed steps takes ``step`` in its place.  A peer that
takes ``xi``, the attitude vector at t = 0 or None, carries it after γ in its states, which then have nine numbers.  A
run that does not reach the last time is a Trajectory with an outcome that says so; InputError is for requests that the
peer cannot serve at all.

Other packages add theirs under the entry point ``heavytop.peers`` (see docs/gate.md).
"""

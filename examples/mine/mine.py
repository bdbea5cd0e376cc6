"""An integrator of one's own behind the call of heavytop: the classical Runge-Kutta method with fixed steps."""

from heavytop.integrate.peers.double import Solution, double_peer


def _solve(request):
    """The solution of a request (start and times as arrays, the field, the step)."""
    field = request.field
    y, time, steps, states = request.start.tolist(), 0.0, 0, []
    for end in request.times.tolist():
        count = max(1, round(abs(end - time) / request.control))
        h = (end - time) / count
        for _ in range(count):
            k1 = field(y)
            k2 = field([a + h / 2 * b for a, b in zip(y, k1, strict=True)])
            k3 = field([a + h / 2 * b for a, b in zip(y, k2, strict=True)])
            k4 = field([a + h * b for a, b in zip(y, k3, strict=True)])
            y = [a + h / 6 * (p + 2 * q + 2 * r + s) for a, p, q, r, s in zip(y, k1, k2, k3, k4, strict=True)]
        time, steps = end, steps + count
        states.append(y)
    return Solution(states, time, steps, 4 * steps)


rk4 = double_peer("mine:rk4", 4, _solve, "step", attitude=True)

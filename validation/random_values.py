"""Published numbers at random, right and wrong, against an integration of other equations by mpmath.

    python validation/random_values.py --bodies 40 --seed 30

Each body has a full tensor, a rotor in every third, a start by Euler angles or by a quaternion.  mpmath's Taylor method
integrates Ω and the quaternion in the axes given to 40 digits: nothing of this program is asked.  Numbers of 1 to 25
digits are printed of it, half of them with an error of random size; each has to get the verdict, and the count of right
digits, that its distance from mpmath's number gives.
"""

from __future__ import annotations

import argparse
from random import Random
from typing import Any

import mpmath

from heavytop.features.claims.audit.audit import audit_claim, claim_from_table

DIGITS = 40
LIB = mpmath.mp.clone()
LIB.dps = DIGITS


def cross(a: Any, b: Any) -> list[Any]:
    """a × b."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a: Any, b: Any) -> Any:
    """a·b."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def product(p: Any, q: Any) -> list[Any]:
    """The product of two quaternions, the scalar first."""
    turned = zip(p[1:], q[1:], cross(p[1:], q[1:]), strict=True)
    return [p[0] * q[0] - dot(p[1:], q[1:]), *(p[0] * b + q[0] * a + c for a, b, c in turned)]


def rotated(q: Any, v: Any) -> list[Any]:
    """q v q̄."""
    return product(product(q, [LIB.mpf(0), *v]), [q[0], -q[1], -q[2], -q[3]])[1:]


def number(text: str) -> Any:
    """A decimal, exactly enough."""
    return LIB.mpf(text)


def body_of(random: Random) -> dict[str, Any]:
    """A body: a tensor that is one by its Gram matrix, in two decimals."""
    low = [[random.randint(-20, 20) for _ in range(3)] for _ in range(3)]
    tensor = [
        [sum(low[k][i] * low[k][j] for k in range(3)) / 1000 + (1 if i == j else 0) for j in range(3)] for i in range(3)
    ]
    body: dict[str, Any] = {
        "mass": f"{random.randint(1, 30) / 10}",
        "gravity": random.choice(("9.81", "1", "0")),
        "centre": [f"{random.randint(-9, 9) / 10}" for _ in range(3)],
        "inertia": [f"{value:.3f}" for row in tensor for value in row],
        "about": "pivot",
    }
    if random.random() < 1 / 3:
        body["rotor"] = [f"{random.randint(-20, 20) / 10}" for _ in range(3)]
    return body


def start_of(random: Random) -> tuple[dict[str, Any], list[Any]]:
    """A start, and its quaternion."""
    omega = [f"{random.randint(-30, 30) / 10}" for _ in range(3)]
    if random.random() < 0.5:
        w, x, y, z = random.choice(((1, 2, 2, 4), (1, 1, 1, 1), (3, 0, 4, 0), (2, 4, 5, 6)))
        size = int((w * w + x * x + y * y + z * z) ** 0.5)
        q = [f"{part}/{size}" for part in (w, x, y, z)]
        return {"omega": omega, "quaternion": q}, [number(part.split("/")[0]) / size for part in q]
    angles = [f"{random.randint(-30, 30) / 10}" for _ in range(3)]
    q = [LIB.mpf(1), LIB.mpf(0), LIB.mpf(0), LIB.mpf(0)]
    for text, axis in zip(angles, (3, 2, 1), strict=True):
        turn = [LIB.cos(number(text) / 2), LIB.mpf(0), LIB.mpf(0), LIB.mpf(0)]
        turn[axis] = LIB.sin(number(text) / 2)
        q = product(q, turn)
    return {"omega": omega, "euler": f"ZYX:{','.join(angles)}"}, q


def known(body: dict[str, Any], start: dict[str, Any], q: list[Any], time: str) -> dict[str, list[Any]]:
    """Every quantity at a time, by mpmath."""
    inertia = LIB.matrix([[number(body["inertia"][3 * i + j]) for j in range(3)] for i in range(3)])
    inverse, wheel = inertia**-1, [number(part) for part in body.get("rotor", ("0", "0", "0"))]
    centre = [number(part) for part in body["centre"]]
    pull = [number(body["mass"]) * number(body["gravity"]) * part for part in centre]

    def up(q: Any) -> list[Any]:
        return rotated([q[0], -q[1], -q[2], -q[3]], [LIB.mpf(0), LIB.mpf(0), LIB.mpf(1)])

    def momentum(omega: Any) -> list[Any]:
        return [sum(inertia[i, j] * omega[j] for j in range(3)) + wheel[i] for i in range(3)]

    def rates(_: Any, y: Any) -> list[Any]:
        omega, attitude = y[:3], y[3:]
        torque = [a + b for a, b in zip(cross(momentum(omega), omega), cross(up(attitude), pull), strict=True)]
        spin = [sum(inverse[i, j] * torque[j] for j in range(3)) for i in range(3)]
        found = [*spin, *(part / 2 for part in product(attitude, [0, *omega]))]
        return [-part for part in found] if time.startswith("-") else found

    y = LIB.odefun(rates, 0, [*(number(part) for part in start["omega"]), *q])(abs(number(time)))
    omega, attitude = y[:3], y[3:]
    kinetic = dot(omega, [a - b for a, b in zip(momentum(omega), wheel, strict=True)]) / 2
    return {
        "omega": list(omega),
        "gamma": up(attitude),
        "quaternion": list(attitude),
        "position": rotated(attitude, centre),
        "energy": [kinetic + dot(pull, up(attitude))],
        "area": [dot(momentum(omega), up(attitude))],
    }


def right_digits(text: str, off: Any) -> tuple[bool, int]:
    """Whether a printed number is right, and how many of its digits: by the text alone.

    What mpmath's number misses half a unit by, which an energy may meet exactly, is less than 1e-32.
    """
    off -= LIB.mpf(10) ** -32
    part = text.partition(".")[2]
    unit = LIB.mpf(10) ** -len(part)
    digits = len(text.lstrip("-").replace(".", "").lstrip("0")) or len(part) + 1
    count = next((k for k in range(digits, 0, -1) if off <= unit * LIB.mpf(10) ** (digits - k) / 2), 0)
    return off <= unit / 2, count


def claim_of(random: Random) -> tuple[dict[str, Any], list[tuple[bool, int]]]:
    """A claim of kind value, and of each of its numbers whether it is right, and how many of its digits."""
    body, (start, q) = body_of(random), start_of(random)
    time = f"{random.choice((-1, 1)) * random.randint(1, 10) / 10}"
    values, expected = [], []
    for quantity, numbers in known(body, start, q, time).items():
        for component, true in enumerate(numbers, 1):
            near = true + random.choice((0, 1, -1)) * LIB.mpf(10) ** -random.randint(1, 26) * random.random()
            text = LIB.nstr(near, random.randint(1, 25), strip_zeros=False, min_fixed=-99, max_fixed=99)
            values.append({"time": time, "quantity": quantity, "component": component, "number": text})
            expected.append(right_digits(text, abs(number(text) - true)))
    return {"name": "x", "kind": "value", "body": body, "start": start, "value": values}, expected


def main() -> int:
    """Prints the counts; 1 where a verdict is false."""
    parser = argparse.ArgumentParser(description="Judge random published numbers.")
    parser.add_argument("--bodies", type=int, default=40)
    parser.add_argument("--seed", type=int, default=30)
    asked = parser.parse_args()
    random = Random(asked.seed)
    counts = {"right": 0, "wrong": 0, "undecided": 0, "false": 0}
    for _ in range(asked.bodies):
        table, expected = claim_of(random)
        report = audit_claim(claim_from_table(table, "random"))
        for row, (right, digits) in zip(report.rows, expected, strict=True):
            said = (row.figures or {}).get("digits_right")
            if row.holds is None:
                counts["undecided"] += 1
                print("undecided:", row.statement, row.residual)
            elif row.holds is not right or said != digits:
                counts["false"] += 1
                print("false:", row.statement, row.residual, said, digits)
            else:
                counts["right" if right else "wrong"] += 1
    print(", ".join(f"{count} {name}" for name, count in counts.items()))
    return 1 if counts["false"] else 0


if __name__ == "__main__":
    raise SystemExit(main())

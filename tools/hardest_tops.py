"""Makes results/hardest-tops.md: the worst that a hunt finds for heyoka, multiword, DOP853 and a splitting.

python tools/hardest_tops.py > results/hardest-tops.md
"""

from __future__ import annotations

from fractions import Fraction

import heavytop as ht
from heavytop.features.hunt.text import worst_lines
from heavytop.precision import shown

HUNTS = (("heyoka", 2000, 100), ("multiword", 500, 100), ("scipy:DOP853", 200, 20), ("splitting:4", 200, 20))
HEAD = """# The hardest tops
What `heavytop hunt` finds for four integrators in double, made by
[`tools/hardest_tops.py`](../tools/hardest_tops.py); the command above each part searches the same again.
How a hunt searches, and what error is expected, is in [hunt.md](../docs/hunt.md).
"""


def short(value: Fraction) -> str:
    """To six digits where it is long."""
    text = str(value)
    return text if len(text) <= 12 else f"{float(value):.6g}"


def data(motion: tuple[ht.HeavyTop, ht.State]) -> str:
    """The data of a motion in a line."""
    top, start = motion
    parts = {"inertia": top.inertia, "weight": (top.weight,), "centre": top.centre}
    parts |= {"omega": start.omega, "gamma": start.gamma}
    return "; ".join(f"{key} {', '.join(map(short, values))}" for key, values in parts.items())


def part(name: str, budget: int, horizon: int) -> str:
    """What is said of one integrator."""
    hunt = ht.hunt(name, budget=budget, horizon=horizon)
    a = hunt.hunted
    lines = [f"\n## {name}", "```text", f"$ {hunt.again}", "```"]
    counts = f"{a.motions} motions to T = {shown(Fraction(horizon))}; {a.lost} lose all digits in any double. "
    lines.append(f"{counts}Its law: {a.law_text}, which bounds nine tenths of random tops (A: amplification).")
    if hunt.found:
        lines += ["", "**Found**, beyond what that explains:", "", "```text", str(hunt), "```"]
    else:
        worst = "The nearest to it:" if a.worst else "All motions tried lose all digits in any double."
        lines += ["", f"Nothing is beyond two decades of that. {worst}", *[""] * bool(a.worst)]
        pairs = zip(worst_lines(a), a.worst, strict=True)
        lines += [f"- {text} `{data(m.motion)}`" for text, m in pairs]
    return "\n".join(lines)


if __name__ == "__main__":
    print(HEAD, end="")
    for each in HUNTS:
        print(part(*each), flush=True)

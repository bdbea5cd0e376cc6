"""The pictures of the gallery as files: ``python tools/pictures.py DIR`` runs its cells and writes PNG and SVG.

The site makes them anew each time that it is built; here they are for slides, papers and a look at all of them.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

CELL = re.compile(r"```\{code-cell\} ipython3\n(.*?)```", re.DOTALL)


def main(folder: Path) -> int:
    """Write the pictures; returns their number."""
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    folder.mkdir(parents=True, exist_ok=True)
    names: dict[str, object] = {}
    count = 0
    for cell in CELL.findall((Path(__file__).parents[1] / "docs" / "gallery.md").read_text("utf-8")):
        if "IPython" in cell:  # a film, which the page alone shows
            continue
        exec(compile(cell.replace("plt.show()", ""), "gallery", "exec"), names)
        for number in plt.get_fignums():
            count += 1
            for suffix in ("png", "svg"):
                plt.figure(number).savefig(folder / f"{count:02d}.{suffix}")
            plt.close(number)
    return count


if __name__ == "__main__":
    print(main(Path(sys.argv[1] if len(sys.argv) > 1 else "pictures")), "pictures")

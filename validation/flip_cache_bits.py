"""What a flipped bit in heyoka's machine-code cache does to a run: ``python validation/flip_cache_bits.py [TRIALS]``.

Each trial starts a fresh process on a copy of a good cache with one bit flipped, anywhere in the file or in the object
code itself, and compares the bits of a run with those that the good cache gives.  Three ways of running: as the program
does (no cache on disk), with the cache forced on and the known first step, and with the cache forced on without it.
"""

import json
import random
import shutil
import sqlite3
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path


def child(cache: str, forced: bool, checked: bool) -> None:
    import heyoka

    from heavytop import DOUBLE, HeavyTop, State, propagate
    from heavytop.integrate.heyoka import engines

    heyoka.llvm_state.set_diskcache_path(cache)
    if forced:
        heyoka.llvm_state.set_diskcache_enabled(True)
    if not checked:
        engines.check = lambda *_: None
    top, start = HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5")), State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
    run = propagate(top, start, range(1, 101), DOUBLE, step_limit=100_000)
    print(json.dumps([run.outcome.value, [[float(value).hex() for value in state] for state in run.states]]))


def outcome(cache: Path, right: str, *flags: str) -> str:
    try:
        done = subprocess.run(
            [sys.executable, __file__, "child", str(cache), *flags],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return "hangs"
    if done.returncode < 0:
        return "crash"
    if done.returncode:
        return "refused" if "Contradiction" in done.stderr else "error"
    return "right" if done.stdout == right else "silently wrong"


def flip(cache: Path, where: str) -> None:
    """Flip one bit of the cache file, or of the object code in it."""
    file = cache / "cache.db"
    if where == "anywhere":
        content = bytearray(file.read_bytes())
    else:
        with sqlite3.connect(file) as base:
            content = bytearray(base.execute("SELECT obj FROM cache").fetchone()[0])
    at = random.randrange(8 * len(content))
    content[at // 8] ^= 1 << at % 8
    if where == "anywhere":
        file.write_bytes(content)
    else:
        with sqlite3.connect(file) as base:
            base.execute("UPDATE cache SET obj = ?", (bytes(content),))


def main(trials: int) -> None:
    random.seed(5)
    ways = {"no cache": (), "cache, checked": ("forced", "checked"), "cache, unchecked": ("forced",)}
    with tempfile.TemporaryDirectory() as folder:
        good = Path(folder) / "good"
        good.mkdir()
        right = subprocess.run(
            [sys.executable, __file__, "child", str(good), "forced"], capture_output=True, text=True, check=True
        ).stdout
        for where in ("anywhere", "object code"):
            counts = {way: Counter[str]() for way in ways}
            for _ in range(trials):
                damaged = Path(folder) / "damaged"
                shutil.copytree(good, damaged)
                flip(damaged, where)
                for way, flags in ways.items():
                    # a run may write to its cache
                    copy = Path(folder) / "copy"
                    shutil.copytree(damaged, copy)
                    counts[way][outcome(copy, right, *flags)] += 1
                    shutil.rmtree(copy)
                shutil.rmtree(damaged)
            for way, count in counts.items():
                print(f"bit flipped {where}, {way}: {dict(count)}", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["child"]:
        child(sys.argv[2], "forced" in sys.argv, "checked" in sys.argv)
    else:
        main(int(sys.argv[1]) if len(sys.argv) > 1 else 50)

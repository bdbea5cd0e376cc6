"""One survey from one process, two workers, a run that was killed, and a cluster that loses workers: the same bytes?

`python validation/survey_processes.py [MOTIONS [WORKERS]]`, by default 20000 motions and four Dask workers of one
thread on this machine, two of which are killed on the way.  Printed for each: seconds, motions per second, the largest
resident set of any of its processes, and the SHA-256 of survey.parquet.  Exit 1 unless all are the same.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import monotonic, sleep

from heavytop.features.survey.gathered import FILE
from heavytop.harness.checkpoint import FILE as ROWS
from survey import PLAN

COMMAND = [sys.executable, "-m", "heavytop", "run"]


def most(pid: int) -> dict[str, float]:
    """The largest resident set so far of a process and its descendants, MB by their ids and commands."""
    found = {}
    try:
        status = Path(f"/proc/{pid}/status").read_text()
        peak = next((line.split()[1] for line in status.splitlines() if line.startswith("VmHWM")), "0")
        found[f"{pid} {Path(f'/proc/{pid}/cmdline').read_bytes().decode().replace(chr(0), ' ')[-60:]}"] = (
            int(peak) / 1024
        )
        for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
            found |= most(int(child))
    except OSError:
        pass
    return found


def begun(out: Path) -> bool:
    """Whether a run has finished a chunk."""
    return (out / ROWS).exists() and (out / ROWS).stat().st_size > 100_000


def ran(arguments: list[str], kill_after: Callable[[], bool] | None = None) -> tuple[float, float]:
    """Seconds of a run of the command line and its largest resident set in MB; killed with SIGKILL where that says."""
    began, peak = monotonic(), 0.0
    with subprocess.Popen([*COMMAND, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        while process.poll() is None:
            peak = max([peak, *most(process.pid).values()])
            if kill_after is not None and kill_after():
                process.kill()
            sleep(0.2)
    return monotonic() - began, peak


def on_cluster(plan: Path, out: Path, workers: int, kill: int) -> tuple[float, float]:
    """The same on a Dask cluster of this machine, of which so many workers are killed once a chunk has come in."""
    address = f"{out}.json"
    dask = [sys.executable, "-m", "dask"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    named = ["--scheduler-file", address]
    cluster = [subprocess.Popen([*dask, "scheduler", *named, "--port", "0", "--no-dashboard"], **quiet)]
    while not Path(address).exists():
        sleep(0.2)
    for _ in range(workers):
        one = [*dask, "worker", *named, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
        cluster.append(subprocess.Popen(one, **quiet))
    victims = cluster[1 : 1 + kill]

    def killer() -> bool:
        if victims and begun(out):
            victims.pop().kill()
        return False

    url = json.loads(Path(address).read_text())["address"]
    found = ran(["--plan", str(plan), "--out", str(out), "--scheduler", url], killer)
    each = [max(most(process.pid).values(), default=0.0) for process in cluster]
    for process in cluster:
        process.terminate()
        process.wait()
    print(f"  scheduler {each[0]:.0f} MB, workers {', '.join(f'{one:.0f}' for one in each[1:])} MB (0: killed)")
    return found[0], max(found[1], *each)


def main(count: int, workers: int) -> int:
    """A line a way."""
    digests = set()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plan = folder / "plan.toml"
        plan.write_text(PLAN.format(count=count))

        def told(way: str, found: tuple[float, float], out: Path) -> None:
            digest = hashlib.sha256((out / FILE).read_bytes()).hexdigest()
            digests.add(digest)
            size = (out / FILE).stat().st_size / count
            print(
                f"{way}: {found[0]:.1f} s, {count / found[0]:.0f} motions a second, at most {found[1]:.0f} MB, "
                f"{size:.0f} bytes a motion, {digest[:16]}",
                flush=True,
            )

        for one in (1, 2):
            out = folder / f"workers{one}"
            told(f"{one} processes", ran(["--plan", str(plan), "--out", str(out), "--workers", str(one)]), out)
        out = folder / "killed"
        asked = ["--plan", str(plan), "--out", str(out), "--workers", "2"]
        seconds, _ = ran(asked, lambda: begun(out))
        print(f"  killed after {seconds:.1f} s with {sorted(p.name for p in out.iterdir())}")
        told("killed and resumed", ran([*asked, "--resume"]), out)
        for lost in (0, 2):
            out = folder / f"cluster{lost}"
            told(f"{workers} Dask workers, {lost} killed", on_cluster(plan, out, workers, lost), out)
    print("the same bytes" if len(digests) == 1 else "OTHER BYTES")
    return int(len(digests) != 1)


if __name__ == "__main__":
    given = [int(text) for text in sys.argv[1:]] + [20000, 4][len(sys.argv) - 1 :]
    sys.exit(main(*given))

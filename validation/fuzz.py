"""Inputs that nobody would give: `python validation/fuzz.py [INPUTS] [SEED]`.

Seeded inputs, 10,000 where no number is given, for the command line and for the Python interface, in this process:
options, numbers and files (plans, claims, trajectories, reports, policies, checkpoints) that are mutated by structure,
by token and by byte.  An answer or an error with its cause is right, whatever the input; counted are *tracebacks*
(anything else that is raised, or an exit code that is none), and *hangs* (no end after 20 s).  What may take longer
by right is told to take less: the audit of a file 10 s, a run 10^5 steps.  Exit code 1 where there is any;
`python validation/fuzz.py N SEED FIRST` begins at the input with the number FIRST, to see one again.

`python validation/fuzz.py 10000 1`, beside other work on two cores: 933 s, the longest input 10.1 s; 0 tracebacks,
0 hangs.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import os
import random
import re
import shutil
import signal
import sys
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from copy import deepcopy
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import gmpy2
import mpmath
import numpy as np

import heavytop as ht
from heavytop.cli import run_command_line
from heavytop.errors import HeavyTopError
from heavytop.features.claims.audit import guard
from heavytop.files import line
from heavytop.integrate import registry

SECONDS = 20
CODES = {0, 1, 2, 3}
PLAN = """name = "tiny"
[[top]]
name = "own"
inertia = ["3", "2", "1"]
weight = "1"
centre = ["1/2", "1/3", "1/5"]
omega = ["1/10", "2/5", "9/10"]
gamma = ["3/5", "0", "4/5"]
[[measure]]
kind = "drift"
cases = ["euler", "own"]
runs = [{ precision = "double", horizon = "2", samples = 4 }]
[[measure]]
kind = "homoclinic"
cases = ["delone"]
precisions = ["double"]
directions = ["forward"]
[[measure]]
kind = "work_precision"
cases = ["euler"]
horizon = "2"
samples = 4
ladders = [{ integrator = "splitting:2", steps = ["1/10", "1/20"] }]
[[measure]]
kind = "local_error"
cases = ["lagrange"]
precisions = ["double"]
horizon = "2"
"""
SHORT_PLAN = PLAN.split('[[measure]]\nkind = "homoclinic"')[0]
CLAIM = """name = "spin"
kind = "integral"
parameters = { I1 = "2", I3 = "1", c = "1/2" }
top = { inertia = ["I1", "I1", "I3"], weight = "1", centre = ["0", "0", "c"] }
integral = { value = "Omega3" }
"""
POLICY = """floor = "4"
loss = "2"
[[allow]]
metric = "drift_*"
loss = "3"
"""
ODD_TEXT = (
    "", " ", "0", "-0", "1", "-1", "1/0", "0/1", "nan", "inf", "-inf", "1e150", "1e151", "-1e150", "1e-150", "1e-400",
    "1e400", "1e9999", "1e99999", "1e-99999", "1e999999999", "9" * 500, "1/" + "7" * 300, "0x1p3", "1_000", "٣", "½",
    "1e",
    "1,2", "a", "\0", "\n", "'", '"', "Ω", "\udc80", "double", "../..", "/dev/zero", "1e14", "1e-12", "3/5", "0.1" * 3,
    "--help", "-", "true", "1.5", "1e3", "real:100", "quad", "x" * 3000, "1e16", "-7/3", "1e-30", "é", "%s", "{}",
    "[", "*",
)  # fmt: skip
ODD_JSON = (
    None, True, False, 0, -1, 1, 2**70, -(2**70), 0.5, 1e308, -1e308, [], {}, "", "nan", "x", "1e-3", "-1", "1/0",
    [1, 2], {"a": 1}, "\x00", "Ω", [[]], "9" * 300, "1e9999", "success", "never", "unresolved", "1e400", "double",
)  # fmt: skip
TOP = ht.HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
START = ht.State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
ODD_PYTHON = (
    *ODD_TEXT, *ODD_JSON, gmpy2.mpz(3), gmpy2.mpq(1, 3), gmpy2.mpfr("0.1"), gmpy2.mpfr("nan"), gmpy2.mpfr("inf"),
    gmpy2.mpfr("1e300000000"), gmpy2.mpc(1), Decimal("0.1"), Decimal("NaN"), Decimal("1e999999"), Fraction(1, 3),
    Fraction(gmpy2.mpz(1), gmpy2.mpz(3)), Fraction(10) ** 200, mpmath.mpf("0.3"), mpmath.inf, np.float64(0.5),
    np.longdouble(1) / 3, np.float32("nan"), np.int8(3), np.array([1.0, 2.0]), np.array([]), np.zeros((2, 6)),
    np.array(1.0),
    math.nan, math.inf, 1j, b"1", object(), range(3), (1, 2, 3), (0, 0, 1), ("3/5", 0, "4/5"), TOP, START, ht.QUAD,
    ht.DOUBLE_DOUBLE, ht.EXTENDED, len, Path("/nowhere"), 10**400, [1, "2", Fraction(3)], [3, 2, 1], [-1, -2],
)  # fmt: skip


class Hang(BaseException):
    """An input that takes too long."""


def structure(random_: random.Random, document: object) -> object:
    """The document with something else in a few of its places, without them, or with them twice."""
    copy = json.loads(json.dumps(document))
    for _ in range(random_.choice((1, 1, 1, 2, 4))):
        inner, key = copy, None
        while isinstance(inner, dict | list) and len(inner) and (key is None or random_.random() < 0.85):
            parent, key = inner, random_.choice(list(inner) if isinstance(inner, dict) else range(len(inner)))
            inner = parent[key]
        if key is None:
            return copy
        how = random_.random()
        if how < 0.2:
            del parent[key]
        elif how < 0.3 and isinstance(parent, list):
            parent.append(parent[key])
        elif how < 0.4 and isinstance(inner, str):
            parent[key] = bytes_of(random_, inner.encode()).decode(errors="replace")
        else:
            parent[key] = deepcopy(random_.choice(ODD_JSON))
    return copy


def tokens(random_: random.Random, text: str) -> str:
    """The text with a few of its words, numbers, lines or brackets changed."""
    for _ in range(random_.choice((1, 1, 2, 3))):
        spans = [m.span() for m in re.finditer(r'"[^"]*"|[\w./+-]+|[][{}=,#]|\n', text)]
        if not spans:
            return text
        begin, end = random_.choice(spans)
        other = random_.choice(spans)
        new = random_.choice(
            ("", json.dumps(random_.choice(ODD_TEXT)), random_.choice(ODD_TEXT), text[slice(*other)], "[]", "{}")
        )
        text = text[:begin] + new + text[end:]
    return text


def bytes_of(random_: random.Random, content: bytes) -> bytes:
    """The bytes cut, flipped, repeated, or with others among them."""
    at, more = random_.randrange(len(content) + 1), random_.randrange(1, 40)
    junk = random_.choice(
        (b"\xff", b"\0", b"\xef\xbb\xbf", b"[" * 20_000, b'{"a":' * 5_000, b"\r", b"-", b"9" * 50, b",")
    )
    return random_.choice(
        (content[:at], content[:at] + content[at + more :], content[:at] + junk + content[at:],
         content[:at] + content[at : at + more] * 2 + content[at + more :], junk)
    )  # fmt: skip


def mutated(random_: random.Random, text: str) -> bytes:
    """A file of text, mutated by token or by byte."""
    if random_.random() < 0.7:
        return tokens(random_, text).encode(errors="replace")
    return bytes_of(random_, text.encode())


class Inputs:
    """Inputs by number, in a folder of their own.

    reports: a small report of every kind that is quick.
    """

    def __init__(self, folder: Path, seed: int) -> None:
        self.folder, self.seed = folder, seed
        (folder / "tiny.toml").write_text(PLAN)
        (folder / "short.toml").write_text(SHORT_PLAN)
        ht.run(folder / "tiny.toml", folder / "report", workers=1)
        self.report = json.loads((folder / "report" / "report.json").read_bytes())
        run = ht.propagate(TOP, START, ["1/2", 1, 2, 3])
        self.trajectory = {
            "name": "mine", "integrator": "mine", "precision": "double", "system": "heavy_top",
            "inertia": ["3", "2", "1"], "weight": "1", "centre": ["1/2", "1/3", "1/5"], "omega": ["1/10", "2/5",
            "9/10"],
            "gamma": ["3/5", "0", "4/5"], "times": ["1/2", "1", "2", "3"], "states": run.texts(),
        }  # fmt: skip
        head = (
            "# inertia: 3, 2, 1\n# weight: 1\n# centre: 1/2, 1/3, 1/5\n# omega: 1/10, 2/5, 9/10\n# gamma: 3/5, 0, 4/5\n"
        )
        rows = zip(self.trajectory["times"], self.trajectory["states"], strict=True)
        self.table = (
            head
            + "t,omega1,omega2,omega3,gamma1,gamma2,gamma3\n"
            + "".join(f"{Fraction(t)!s},{','.join(s)}\n" for t, s in rows)
        )
        self.checkpoint = self._interrupted()

    def _interrupted(self) -> dict[str, bytes]:
        """The files of a run that was stopped after its first row."""
        from heavytop.api.run_folder import prepare

        def stop(task: object) -> None:
            raise KeyboardInterrupt

        out = self.folder / "stopped"
        try:
            prepare(str(self.folder / "short.toml"), out, workers=1, save_every=0.0).measure(stop)
        except KeyboardInterrupt:
            return {path.name: path.read_bytes() for path in out.iterdir()}
        raise AssertionError

    def call(self, number: int) -> tuple[str, Callable[[], object]]:
        """What is tried, and how."""
        random_ = random.Random(f"{self.seed} {number}")
        kinds = {
            self.motion: 30, self.python: 30, self.reports: 16, self.score: 8, self.policy: 6, self.plan: 2,
            self.options: 2, self.resumed: 0.8, self.claim: 0.4,
        }  # fmt: skip
        kind = random_.choices(list(kinds), list(kinds.values()))[0]
        return kind(random_)

    def command(self, *arguments: object) -> tuple[str, Callable[[], object]]:
        texts = [str(argument).replace("\0", "") for argument in arguments]  # no system passes a NUL on

        def call() -> object:
            sys.argv = ["heavytop", *texts]
            code = run_command_line()
            if code not in CODES:
                raise AssertionError(f"exit code {code}")
            return code

        return " ".join(text[:60] for text in texts), call

    def file(self, name: str, content: bytes) -> Path:
        path = self.folder / name
        path.write_bytes(content)
        return path

    def motion(self, random_: random.Random):
        """`propagate` or `reference` with odd options."""
        which = random_.choice(("propagate", "propagate", "reference"))
        options = {
            "inertia": "3,2,1", "weight": "1", "centre": "1/2,1/3,1/5", "omega": "1/10,2/5,9/10", "gamma": "3/5,0,4/5",
            "times": "1/2,1",
        }  # fmt: skip
        for _ in range(random_.choice((0, 1, 1, 2, 3))):
            name = random_.choice(list(options))
            parts = options[name].split(",")
            parts[random_.randrange(len(parts))] = random_.choice(ODD_TEXT)
            options[name] = random_.choice((",".join(parts), ",".join(parts), random_.choice(ODD_TEXT)))
        more = {
            "propagate": (["--precision", random_.choice(("double", "quad", "extended", "double-double", "real:40",
            *ODD_TEXT))],
                          ["--integrator", random_.choice(("multiword", "splitting:2", "scipy:LSODA", *ODD_TEXT))],
                          ["--max-steps", random_.choice(("3", "0", *ODD_TEXT))], ["--attitude"]),
            "reference": (["--digits", random_.choice(("1", "30", "200", "0", "x", "1e3", "-1"))], ["--attitude"]),
        }[which]  # fmt: skip
        chosen = [*more, ["--json"], ["--normalize"], ["--system", random_.choice(("gyrostat", *ODD_TEXT))]]
        extra = [text for option in random_.sample(chosen, random_.choice((0, 1, 1, 2))) for text in option]
        return self.command(which, *(f"--{name}={value}" for name, value in options.items()), *extra)

    def python(self, random_: random.Random):
        """A public function with odd arguments."""
        times = [1, 2]
        states = [[float(x) for x in row] for row in self.trajectory["states"][1:3]]
        calls = {
            "HeavyTop": (ht.HeavyTop, {"inertia": (3, 2, 1), "weight": 1, "centre": (0, 0, 1)}),
            "State": (ht.State, {"omega": (1, 2, 3), "gamma": (0, 0, 1)}),
            "propagate": (ht.propagate, {"top": TOP, "start": START, "times": times, "precision": "double",
                          "integrator": "heyoka", "system": "heavy_top", "step_limit": 50, "tolerance": None,
                          "xi": None}),
            "ensemble": (ht.ensemble, {"tops": [TOP, TOP], "starts": START, "times": times, "precision": "double",
                         "integrator": "multiword", "threads": 2, "step_limit": 50, "system": "heavy_top"}),
            "reference": (ht.reference, {"top": TOP, "start": START, "times": times, "digits": 20,
            "system": "heavy_top",
                          "attitude": False}),
            "score": (ht.score, {"times": times, "states": states, "top": TOP, "start": START, "precision": None,
                      "system": "heavy_top", "name": "a", "integrator": "b"}),
            "drift": (ht.drift, {"run": ht.propagate(TOP, START, [1])}),
            "compare": (ht.compare, {"baseline": self.folder / "report", "candidate": self.folder / "report",
            "policy": None,
                        "floor": None, "loss": None}),
            "read_report": (ht.read_report, {"path": self.folder / "report"}),
            "real": (ht.real, {"bits": 60}),
        }  # fmt: skip
        name = random_.choices(list(calls), [1, 1, 4, 2, 3, 2, 0.3, 0.4, 0.3, 0.3])[0]
        function, arguments = calls[name]
        for _ in range(random_.choice((1, 1, 2))):
            place = random_.choice(list(arguments))
            value = arguments[place]
            odd = random_.choice(ODD_PYTHON)
            if isinstance(value, list | tuple) and value and random_.random() < 0.6:
                odd = [*value[:-1], odd]
            arguments[place] = odd

        def call() -> object:
            return repr(function(**arguments))

        return f"{name}({', '.join(f'{k}={ascii(v)[:40]}' for k, v in arguments.items())})", call

    def _report(self, random_: random.Random) -> Path:
        out = self.folder / "edited"
        out.mkdir(exist_ok=True)
        text = json.dumps(structure(random_, self.report)).encode()
        content = bytes_of(random_, text) if random_.random() < 0.2 else text
        (out / "report.json").write_bytes(content)
        digest = out / "report.json.sha256"
        digest.unlink(missing_ok=True)
        if random_.random() < 0.5:
            digest.write_text(f"{hashlib.sha256(content).hexdigest()}  report.json\n")
        return out

    def reports(self, random_: random.Random):
        """A mutated report, compared, shown, drawn."""
        out, good = self._report(random_), self.folder / "report"
        page = f"--html={self.folder / 'page.html'}"
        return self.command(
            *random_.choice(
                (("compare", good, out), ("compare", out, good, "--json"), ("compare", out, out, page), ("show", out,
                "--full"),
                 ("show", out), ("show", out, page), ("history", good, out, "--json"), ("history", out, good, page),
                 ("show", out, f"--parquet={self.folder / 'rows.parquet'}"))
            )
        )  # fmt: skip

    def score(self, random_: random.Random):
        """A mutated trajectory."""
        if random_.random() < 0.6:
            content = json.dumps(structure(random_, self.trajectory)).encode()
            if random_.random() < 0.2:
                content = bytes_of(random_, content)
            path = self.file("mine.json", content)
        else:
            path = self.file("mine.csv", mutated(random_, self.table))
        more = random_.choice(([], [], ["--json"], [f"--html={self.folder / 'score.html'}"], ["--case", "lagrange"]))
        return self.command("score", path, *more)

    def policy(self, random_: random.Random):
        """A mutated policy, and odd limits."""
        path = self.file("policy.toml", mutated(random_, POLICY))
        more = random_.choice(
            ([], [f"--floor={random_.choice(ODD_TEXT)}"], [f"--loss={random_.choice(ODD_TEXT)}"], ["--json"])
        )
        return self.command("compare", self.folder / "report", self.folder / "report", "--policy", path, *more)

    def plan(self, random_: random.Random):
        """A mutated plan, run."""
        path = self.file("plan.toml", mutated(random_, random_.choice((SHORT_PLAN, SHORT_PLAN, PLAN))))
        shutil.rmtree(self.folder / "out", ignore_errors=True)
        more = random_.choice(
            ([], [], [f"--seed={random_.choice(ODD_TEXT)}"], [f"--integrator={random_.choice(ODD_TEXT)}"])
        )
        return self.command("run", "--plan", path, "--out", self.folder / "out", "--workers", "1", *more)

    def options(self, random_: random.Random):
        """Any command with any words."""
        commands = ("compare", "history", "show", "propagate", "reference", "score", "audit", "list", "--version")
        words = random_.choices((*ODD_TEXT, "--json", "--case", "--out", "--help", "--plan"), k=random_.randrange(4))
        return self.command(random_.choice(commands), *words)

    def resumed(self, random_: random.Random):
        """A run that goes on from mutated files whose checksums are right."""
        out = self.folder / "resumed"
        shutil.rmtree(out, ignore_errors=True)
        out.mkdir()
        for name, content in self.checkpoint.items():
            lines = content.splitlines()
            place = random_.randrange(len(lines)) if lines else None
            for at, each in enumerate(lines):
                if at == place:
                    document = structure(random_, json.loads(each.split(b" ", 1)[1]))
                    lines[at] = line(json.dumps(document).encode())[:-1]
            (out / name).write_bytes(b"".join(each + b"\n" for each in lines))
        return self.command("run", "--plan", self.folder / "short.toml", "--out", out, "--workers", "1", "--resume")

    def claim(self, random_: random.Random):
        """A mutated claim, audited."""
        return self.command(
            "audit", self.file("claim.toml", mutated(random_, CLAIM)), *random_.choice(([], ["--json"]))
        )


def tried(call: Callable[[], object]) -> str:
    """ "" where the input got an answer or an error with its cause; else what went wrong, and where."""

    def stop(*_: object) -> None:
        raise Hang

    signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, SECONDS)
    try:
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            call()
    except HeavyTopError:
        return ""
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        ours = [each for each in traceback.extract_tb(error.__traceback__) if "heavytop" in each.filename]
        where = ours[-1] if ours else frame
        what = "hang" if isinstance(error, Hang) else type(error).__name__
        return f"{what} at {Path(where.filename).name}:{where.lineno}: {str(error)[:100]!r}"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
    return ""


def main(count: int = 10_000, seed: int = 1, first: int = 0) -> int:
    guard.in_time.__defaults__ = (SECONDS / 2,)
    registry.MOST_STEPS, registry._FAR_BELOW = 10**5, 1e4
    found: Counter[str] = Counter()
    kinds: Counter[str] = Counter()
    began, longest = perf_counter(), 0.0
    with TemporaryDirectory() as folder:
        os.chdir(folder)
        inputs = Inputs(Path(folder), seed)
        for number in range(first, first + count):
            text, call = inputs.call(number)
            at = perf_counter()
            problem = tried(call)
            longest = max(longest, perf_counter() - at)
            kinds[re.split(r"[ (]", text)[0]] += 1
            if (number + 1) % 500 == 0:
                print(f"{number + 1}: {perf_counter() - began:.0f} s", flush=True)
            if problem:
                found["hangs" if problem.startswith("hang") else "tracebacks"] += 1
                print(f"{number}: {problem}\n    {ascii(text)[:300]}", flush=True)
        os.chdir("/")
    said = f"{found['tracebacks']} tracebacks, {found['hangs']} hangs"
    print(f"{count} inputs in {perf_counter() - began:.0f} s, the longest {longest:.1f} s: {said}; {dict(kinds)}")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))

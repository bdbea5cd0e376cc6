"""A program that integrates over the line protocol by RK4, and the ways in which it can be wrong.

Run as ``python faulty_program.py FAULT``; without one it is right.
"""

import math
import os
import signal
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "src"))

from heavytop.top.equations import HEAVY_TOP, Parameters


def step(f, y, h):
    def moved(k, share):
        return [a + share * h * b for a, b in zip(y, k, strict=True)]

    k1 = f(y)
    k2 = f(moved(k1, 0.5))
    k3 = f(moved(k2, 0.5))
    k4 = f(moved(k3, 1))
    mean = [(p + 2 * q + 2 * r + s) / 6 for p, q, r, s in zip(k1, k2, k3, k4, strict=True)]
    return moved(mean, 1)


def out(*words):
    print(*words, flush=True)


def hang():
    while True:
        time.sleep(60)


def daemon():
    """What is left of it has another session, and no parent."""
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            hang()
        os._exit(0)
    os.wait()


GREETINGS = {
    "silent at the start": hang,
    "dies at the start": lambda: sys.exit("no licence found"),
    "another greeting": lambda: out("Welcome to my integrator"),
    "errors only": lambda: (print("ready on the wrong stream", file=sys.stderr, flush=True), hang()),
    "killed at the start": lambda: os.kill(os.getpid(), signal.SIGKILL),
}
INSTEAD = {  # of the answer to a request with times
    "silent": hang,
    "leaves its group": lambda: (os.setsid(), hang()),
    "busy": lambda: next(i for i in iter(int, 1)),
    "crashes": lambda: os.kill(os.getpid(), signal.SIGSEGV),
    "leaves a child behind": lambda: os._exit(5) if os.fork() else hang(),
    "not utf-8": lambda: (sys.stdout.buffer.write(b"\xff\xfe\n"), sys.stdout.flush(), hang()),
    "closes its output": lambda: (os.close(1), hang()),
    "a line without an end": lambda: (sys.stdout.write("9" * 3_000_000), sys.stdout.flush(), hang()),
    "1 GB": lambda: [sys.stdout.write("state 0.5 1 2 3 4 5 6\n" * 10_000) for _ in iter(int, 1)],
    "aborts": lambda: out("failed no convergence at t = 1.3"),
    "only done": lambda: out("done"),
    "prompts": lambda: out("> state 0.5 1 2 3 4 5 6"),
    "an empty line": lambda: out(""),
}


def shown(fault, values, place):
    """The numbers of a state as they are printed."""
    texts = [f"{value:.17g}" for value in values]
    match fault:
        case "nan" if place == 1:
            texts[2] = "nan"
        case "overflow":
            texts[0] = "1e999"
        case "comma":
            texts = [text.replace(".", ",") for text in texts]
        case "a word":
            texts[3] = "zero"
        case "underscores":
            texts[0] = "1_0.5"
        case "seven numbers":
            texts.append("0")
        case "five numbers":
            texts.pop()
        case "six digits":
            texts = [f"{value:.6g}" for value in values]
        case "single precision":
            import struct

            texts = [f"{struct.unpack('f', struct.pack('f', value))[0]:.17g}" for value in values]
        case "swapped":
            texts = texts[3:] + texts[:3]
        case "other each time":
            texts[0] = f"{values[0] + 1e-9 * (time.time_ns() % 1000):.17g}"
    return texts


def answer(fault, given):
    numbers = {name: list(map(float, words)) for name, words in given.items() if name in ("inertia", "moment", "state")}
    p = Parameters(numbers["inertia"], numbers["moment"], 0.0)
    y, t, steps = numbers["state"], 0.0, 0
    own = {"ignores its step": 0.01, "has small steps": 0.001}.get(fault)
    h = own or float(given.get("setting", ["0.01"])[0])
    times = given["times"][1:]
    if fault == "wrong order":
        times = times[::-1]
    if fault == "times off by one":
        times = ["0", *times[:-1]]
    if fault == "one state short":
        times = times[:-1]
    for place, text in enumerate(times):
        end = float(text)
        count = math.ceil(abs(end - t) / h)
        if fault == "begins badly":
            y = [value + 1e-9 * rate for value, rate in zip(y, HEAVY_TOP.field(p, y), strict=True)]
        if fault == "wrong backwards" and end < t:
            y[2] *= 1 + 1e-7
        for _ in range(count):
            y = step(lambda y: HEAVY_TOP.field(p, y), y, h if fault == "whole last steps" else (end - t) / count)
        t, steps = end, steps + count
        out("state", text, *shown(fault, y, place))
        if fault == "ends in the middle":
            sys.exit(1)
    if fault == "one state more":
        out("state", times[-1], *y)
    match fault:
        case "no done":
            hang()
        case "no line end":
            sys.stdout.write("done")
            sys.stdout.flush()
            sys.exit(0)
        case "two states in a line":
            out("done steps")
        case "negative steps":
            out("done steps -5")
        case "steps in words":
            out("done steps many")
        case "seconds that are none":
            out("done seconds nan")
        case "counts wrongly":
            out("done steps", 10 * steps)
        case "counts none":
            out("done")
        case "talks on":
            sys.stdout.write(f"done steps {steps}\nthat was fun\n")
            sys.stdout.flush()
        case _:
            out("done steps", steps, "evaluations", 4 * steps, "seconds 0.001")


def main():
    fault = " ".join(sys.argv[1:])
    given, requests = {}, 0
    for line in sys.stdin:
        name, *words = line.split()
        if name == "heavytop-integrator":
            if fault == "forks" and os.fork() == 0:
                hang()
            if fault == "becomes a daemon":
                daemon()
            if fault == "chatty errors":
                print("x" * 200_000, file=sys.stderr, flush=True)
            GREETINGS.get(fault, lambda: out("ready faulty 1.2"))()
        elif name == "quit":
            if fault == "ignores quit":
                hang()
            return
        elif name == "go":
            requests += 1
            if fault == "naps":
                time.sleep(0.03)
            if fault == {3: "dies at the third request", 4: "dies at the fourth request"}.get(requests):
                sys.exit("out of memory")
            if fault == "begins otherwise" and requests == 1:
                given["inertia"][0] += "1"
            if int(given["times"][0]) and fault in INSTEAD:
                INSTEAD[fault]()
            elif given["times"] == ["0"]:
                if fault == "needs a time":
                    sys.exit("list index out of range")
                if fault == "needs a setting":
                    given["setting"][0]
                out("done steps 0")
            else:
                answer(fault, given)
            given = {}
        elif fault == "knows too little" and name.startswith("unknown"):
            out("failed what is", name)
        else:
            given[name] = words
    if fault == "outlives its input":
        hang()


signal.signal(signal.SIGTERM, signal.SIG_IGN)
main()

"""States that a program writes several at a time are those that its lines give one by one, or are left to these."""

from fractions import Fraction
from random import Random

import numpy
import pytest

from heavytop.cases import CASES
from heavytop.errors import PeerFailed
from heavytop.integrate.peers.command import ProgramRequest, Reply, _times_written
from heavytop.integrate.trajectory import Problem
from heavytop.precision import DOUBLE, QUAD

CASE = CASES["lagrange"]
TIMES = [Fraction(k, 8) for k in range(1, 10)]


def reply(precision=DOUBLE) -> Reply:
    return Reply("mine", ProgramRequest(Problem.of(CASE.top, CASE.start, precision), TIMES, None, False))


def lines(random: Random, form: str = "{:.17g}") -> list[bytes]:
    rows = ([float(time), *(random.gauss(0, 10 ** random.randint(-9, 9)) for _ in range(6))] for time in TIMES)
    return [f"state {' '.join(form.format(value) for value in row)}".encode() for row in rows]


@pytest.mark.parametrize("form", ["{:.17g}", "{!r}", "{:.30e}", "  {:.20f} \t"])
def test_every_bit_is_that_of_single_lines(form: str) -> None:
    random = Random(form)
    for _ in range(20):
        written = lines(random, form)
        whole, single = reply(), reply()
        cut = random.randint(0, len(written))
        for part in (written[:cut], written[cut:]):
            taken = whole.take_states(part)
            assert taken == (len(part) if len(part) > 1 else 0)
            for line in part[taken:]:
                assert not whole.take(line)
        for line in written:
            assert not single.take(line)
        assert [each.tobytes() for each in whole.states] == [each.tobytes() for each in single.states]
        assert whole.due == single.due == 0


@pytest.mark.parametrize("odd", ["-0", "1.", ".5", "+1", "1e999", "nan", "1_0", "0x1p0", "1/2", "1,5", "", "1 2", "é"])
def test_an_odd_number_is_left_to_its_line(odd: str) -> None:
    written = lines(Random(1))
    words = written[3].split()
    written[3] = b" ".join([*words[:4], odd.encode(), *words[5:]])
    answer, single = reply(), reply()
    assert answer.take_states(written) == 0
    assert answer.states == []
    try:
        for line in written:
            single.take(line)
    except PeerFailed:
        assert len(single.states) == 3
    else:
        assert numpy.signbit(single.states[3][2]) == (odd == "-0")


@pytest.mark.parametrize("change", ["more", "other time", "fewer numbers", "done within"])
def test_states_that_are_not_those_due_are_left_to_their_lines(change: str) -> None:
    written = lines(Random(2))
    if change == "more":
        assert reply().take_states([*written, written[-1]]) == len(written)
        return
    written[4] = {
        "other time": written[5],
        "fewer numbers": written[4].rsplit(maxsplit=1)[0],
        "done within": b"done steps 3",
    }[change]
    assert reply().take_states(written) == 0


def test_other_formats_are_read_line_by_line() -> None:
    answer = reply(QUAD)
    assert answer.take_states(lines(Random(3))) == 0


def test_times_that_change_are_written_anew() -> None:
    first = _times_written(TIMES, DOUBLE, False)
    assert _times_written(list(TIMES), DOUBLE, False) is first
    for times, precision, hexadecimal in ((TIMES[:-1], DOUBLE, False), (TIMES, QUAD, False), (TIMES, DOUBLE, True)):
        other = _times_written(times, precision, hexadecimal)
        assert other.times == times
        assert len(other.texts) == len(times)
    assert other.texts[0] == "0x1p-3"


def test_the_next_reading_comes_the_sooner_the_less_is_left() -> None:
    answer = reply()
    assert answer.nap(1.0) == 0.25
    answer.states = [None] * 8
    assert answer.nap(0.8) == pytest.approx((0.8 / 8) / 3)

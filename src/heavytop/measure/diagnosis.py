"""What went wrong in a motion that is off, told by trying it: a supposition counts only if it explains the states.

Every supposition is a motion that is computed and compared with the states.  It is told if the error falls by two
decades with it, by three where a number was fitted to the states; otherwise nothing is said.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction

import numpy

from heavytop.measure import mistaken_data, mistaken_equations, mistaken_states, mistaken_times
from heavytop.measure.suspects import ALIKE, DROP, FITTED_DROP, FLOOR, Array, Suspect, Units, suspect
from heavytop.measure.written import explains, rounding
from heavytop.precision import Precision, decimal_text
from heavytop.top.equations import System
from heavytop.top.heavy_top import HeavyTop, State
from heavytop.top.integrals import holding

_WORTH_ASKING = 1e-10
"""Relative errors below it are no mistake of this kind."""
_WRONG = 1e-3
"""Smaller ones are not those of other equations."""
_TOO_FAR = 1.0
"""Taken for the error where heyoka does not get to the times."""
_CONSTANT = 100.0
"""Integrals are constant but off if they are off by so many times what they vary by."""
_OFF = 1e-3
"""... and by so much of what they may be."""
_FEWEST_ROWS = 4
_FEWEST_FROZEN = 3
_ALONE = 1000.0
"""A state is alone in being off if it is off by so many times as much as any other."""


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """A mistake that explains the states.

    kind: which; docs/score.md lists them.  numbers: what fits, as text, by name.
    error: the largest error of the states that were looked at, relative to the size of Ω and of γ; left: what is left
    of it if the mistake is mended.  Both None where nothing was tried: then the states themselves show it.
    looked_at: how many of the states, of how many, and the time of the last of them, as text, where not all were.
    """

    kind: str
    numbers: dict[str, str] = field(default_factory=dict)
    error: float | None = None
    left: float | None = None
    looked_at: tuple[int, int, str] | None = None


def diagnose(
    top: HeavyTop,
    start: State,
    system: System,
    times: Sequence[Fraction],
    states: Sequence[Sequence[Fraction]],
    precision: Precision,
    relative_error: float | None,
) -> list[Diagnosis]:
    """What explains the states of a motion, at most one mistake and what their digits say; empty where nothing does.

    relative_error: the largest |error|/max(1, |value|) that was measured; None without a reference.
    """
    found: list[Diagnosis] = []
    if relative_error is None or relative_error > _WRONG:
        found += _frozen(times, states)
    if found:
        return found
    given = suspect(top, start, system, times, states)
    if given is not None:
        truth = given.supposed(given.times)
        error = _TOO_FAR if truth is None else given.error(truth)
        with numpy.errstate(all="ignore"):  # what overflows explains nothing
            mistake = _mistake(given, truth, error, states) if error > _WORTH_ASKING else None
        found += [mistake] if mistake else []
    written = rounding(states, precision)
    if written is not None and relative_error is not None and not found and explains(written, relative_error):
        found.append(Diagnosis("rounded", {"to": written.kind, "digits": str(written.digits)}))
    return found


def _mistake(
    given: Suspect, truth: Array | None, error: float, states: Sequence[Sequence[Fraction]]
) -> Diagnosis | None:
    """The simplest mistake among those that explain the states about as well as the best."""
    if len(states) > 2 and all(list(state) == list(states[0]) for state in states):
        return Diagnosis("constant")
    explained = [each for each in _suppositions(given, truth) if each[2] * each[3] <= error]
    if not explained and error > _WRONG:
        others = mistaken_equations.suppositions(given, truth)
        explained = [(*each, FITTED_DROP) for each in others if each[2] * FITTED_DROP <= error]
    if not explained:
        return _of_many(given.widened()) or _looked_at(given, _integrals_off(given, error))
    best = min(max(left, FLOOR) for *_, left, _ in explained)
    kind, numbers, left, _ = next(each for each in explained if each[2] <= ALIKE * best)
    return _looked_at(given, Diagnosis(kind, numbers, error, left))


def _frozen(times: Sequence[Fraction], states: Sequence[Sequence[Fraction]]) -> list[Diagnosis]:
    """From some time on every state is the same, which are three at least, and not all."""
    same = next((n for n, state in enumerate(reversed(states)) if list(state) != list(states[-1])), len(states))
    if same < _FEWEST_FROZEN or same == len(states):
        return []
    return [Diagnosis("frozen", {"t": decimal_text(times[-same], 6), "states": f"{same} of {len(states)}"})]


def _of_many(every: Suspect) -> Diagnosis | None:
    return _looked_at(every, _lone_state(every) or _lost_row(every))


def _looked_at(given: Suspect, found: Diagnosis | None) -> Diagnosis | None:
    """The same, with how many of the states it was found in, where that is not all of them."""
    looked, all_of_them = len(given.rows), len(given.all_times)
    if found is None or looked == all_of_them:
        return found
    return replace(found, looked_at=(looked, all_of_them, _text(given.times[-1], given.units.time)))


Supposition = tuple[str, dict[str, str], float, float]
"""Kind, numbers, the error that is left, and how far it must have fallen."""


def _suppositions(given: Suspect, truth: Array | None) -> Iterator[Supposition]:
    """The simplest first, those with a fitted number last."""
    reading = None if truth is None else mistaken_states.reading(given, truth)
    if reading is not None and reading[0].changes == 1:
        yield _of_reading(*reading)
    for data, left in mistaken_data.without_numbers(given):
        yield data.kind, dict(data.numbers), left, DROP
    clock = mistaken_times.clock(given)
    if clock is not None and not clock[0].fitted:
        yield _of_clock(*clock, given.units)
    if reading is not None and reading[0].changes > 1:
        yield _of_reading(*reading)
    if clock is not None and clock[0].fitted:
        yield _of_clock(*clock, given.units)
    for supposed in (mistaken_data.another_weight, mistaken_data.another_start, mistaken_data.another_top):
        found = supposed(given)
        if found is not None:
            data, left = found
            yield data.kind, dict(data.numbers), left, max(FITTED_DROP, data.required)


def _of_reading(reading: mistaken_states.Reading, left: float) -> Supposition:
    numbers: dict[str, str] = {}
    if reading.meaning:
        numbers["meaning"] = reading.meaning
    if reading.axes != (1, 2, 3):
        numbers |= {"axes": ",".join(map(str, reading.axes)), "of": reading.of}
    if reading.swapped:
        numbers["order"] = "gamma before omega"
    if len(numbers) == 1 and reading.meaning:
        return reading.meaning, {}, left, DROP
    if reading.swapped and len(numbers) == 1:
        return "columns_swapped", {}, left, DROP
    return ("axes_permuted" if "meaning" not in numbers and not reading.swapped else "columns"), numbers, left, DROP


def _of_clock(clock: mistaken_times.Clock, left: float, units: Units) -> Supposition:
    numbers = {"shift": _text(clock.shift, units.time)} if clock.kind == "times_shifted" else {}
    numbers |= {"factor": f"{clock.factor:.6g}"} if clock.kind == "time_unit" else {}
    return clock.kind, numbers, left, FITTED_DROP if clock.fitted else DROP


def _lone_state(every: Suspect) -> Diagnosis | None:
    """One state, neither the first nor the last, that is off while all others are right."""
    truth = every.supposed(every.times)
    if truth is None:
        return None
    errors = every.errors(truth)
    worst = int(numpy.argmax(errors))
    left = float(numpy.delete(errors, worst).max(initial=0.0))
    if not 0 < worst < len(errors) - 1 or left * _ALONE > errors[worst]:
        return None
    return Diagnosis("one_state", {"t": _text(every.times[worst], every.units.time)}, float(errors[worst]), left)


def _lost_row(every: Suspect) -> Diagnosis | None:
    """States that are right up to a time, and from there on those of the next sample, or of the one before."""
    times = every.times
    if len(times) < _FEWEST_ROWS:
        return None
    ends = {"row_missing": [*times[1:], 2 * times[-1] - times[-2]], "row_twice": [Fraction(0), *times[:-1]]}
    found = [(kind, every.supposed(moved)) for kind, moved in ends.items()]
    truth = every.supposed(times)
    if truth is None:
        return None
    own = every.errors(truth)
    for kind, moved_truth in found:
        if moved_truth is None:
            continue
        moved = every.errors(moved_truth)
        left = [max(own[:row].max(), moved[row:].max()) for row in range(1, len(times) - 1)]
        row = int(numpy.argmin(left))
        if left[row] * _ALONE <= own.max():
            return Diagnosis(kind, {"t": _text(times[row + 1], every.units.time)}, float(own.max()), float(left[row]))
    return None


def _integrals_off(given: Suspect, error: float) -> Diagnosis | None:
    """First integrals that keep their values from the first sample on, but not those of the start."""
    if len(given.rows) < 3:
        return None
    p = given.system.parameters(given.top, given.start)
    inertia, moment = max(map(float, p.inertia)), max(abs(float(value)) for value in p.moment)
    sizes = {"gamma_squared": 1.0, "area": inertia * given.rate, "energy": inertia * given.rate**2 + moment}
    units = {"gamma_squared": Fraction(1), "area": given.units.moment * given.units.time, "energy": given.units.moment}
    start = [float(value) for value in given.start.flat]
    numbers: dict[str, str] = {}
    for integral in holding(given.top, given.start, given.system):
        values = numpy.array([float(integral.value(p, list(state))) for state in given.states])
        at_start = float(integral.value(p, start))
        off, varies = abs(float(values.mean()) - at_start), float(values.max() - values.min())
        if off > max(_CONSTANT * varies, _OFF * sizes.get(integral.name, float("inf"))):
            unit = units[integral.name]
            numbers[integral.name] = f"{_text(values.mean(), unit)}, not {_text(at_start, unit)}"
    return Diagnosis("integrals_off", numbers, error) if numbers else None


def _text(value: float | Fraction, unit: Fraction) -> str:
    """A number of the data's own units, to six digits."""
    text = decimal_text(Fraction(value) * unit, 6)
    return text.rstrip("0").rstrip(".") if "." in text and "E" not in text else text

"""Python interface of the score: drift of first integrals, distance from the known motion, digits right."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, NamedTuple

import numpy

from heavytop import arguments
from heavytop.arguments import Number, Numbers, required
from heavytop.display import Tabular, TitledTable
from heavytop.errors import ExitCode, InputError, quoted
from heavytop.features.score.measurement import Assessment, assess, passed
from heavytop.features.score.text import diagnosis_text, score_report, to_json
from heavytop.features.score.trajectories.columns import USED_BY, numbers_of_row, unused
from heavytop.features.score.trajectories.observed import (
    GivenTrajectory,
    of_arrays,
    of_observed_arrays,
    raw_start,
    require_system,
)
from heavytop.integrate.trajectory import Trajectory
from heavytop.measure.attitude_error import ATTITUDE_ERROR, POSITION_ERROR, WIDTHS, Convention
from heavytop.measure.scalar import digits_kept, digits_text
from heavytop.measure.scorer import DRIFT, SOLUTION_ERROR, Drift
from heavytop.precision import Precision, ordered, vector
from heavytop.records import Metric, Peer, Report, Row
from heavytop.report.document.document import integral_text, short
from heavytop.top.bodies import Body
from heavytop.top.equations import System
from heavytop.top.heavy_top import HeavyTop, State, check_times

PathLike = str | os.PathLike[str]

# Arrays of quaternions, matrices, Euler angles, positions and Ω in any axes, checked for :func:`heavytop.score`.


_SHAPES = {
    "quaternion": "(n, 4)",
    "matrix": "(n, 3, 3)",
    "states": "(n, 6), in the order Ω1 Ω2 Ω3 γ1 γ2 γ3",
}


def columns(arrays: Mapping[str, Any], states: list[list[Any]] | None) -> dict[str, list[list[Any]]]:
    """The rows of every array that is given, in the order in which they are scored; ``states`` are Ω and γ.

    Raises InputError for another shape, and for what is given twice.
    """
    rows_by_name = {name: _rows(values, name) for name, values in arrays.items() if values is not None}
    if states is not None:
        for name, part in (("omega", slice(0, 3)), ("gamma", slice(3, 6))):
            if name in rows_by_name:
                raise InputError(f"states and {name} were both given.", "Give one of them.")
            rows_by_name[name] = [row[part] for row in states]
    if not rows_by_name:
        raise InputError("Nothing to score was given.", "Give states, quaternions, positions or another array.")
    return {name: rows_by_name[name] for name in WIDTHS if name in rows_by_name}


def _rows(values: Any, name: str) -> list[list[Any]]:
    rows = ordered(values, name, f"Give an array of shape {_SHAPES.get(name, '(n, 3)')}.")
    return [numbers_of_row(row, WIDTHS.get(name, 6), f"{name}[{i}]") for i, row in enumerate(rows)]


_PARTS = ("omega", "gamma", "along", "across")
_LABELS = {
    "omega": "error of Ω",
    "gamma": "error of γ",
    "along": "along the flow",
    "across": "across the flow",
    "attitude": "error of the attitude (rad)",
    "position": "error of the position",
    "position_relative": "error of the position, relative",
}
_HEADER = ("", "largest", "rms", "final")


class Summary(NamedTuple):
    """A measured size over the samples: the largest, the root mean square, and that of the last one.

    Each has ``value`` (decimal text), ``log10``, and compares and converts as a float.
    """

    max: Metric
    rms: Metric
    final: Metric


@dataclass(frozen=True, slots=True, repr=False)
class Score(Tabular):
    """The score of a motion.

    outcome: ``success``, or ``non_finite`` where a state is NaN or infinite: those before it are scored.
    drift: |I(t) − I(0)| by the name of the first integral, in its units.
    distance: from the known motion, by ``omega`` (1/time unit), ``gamma``, ``along`` the flow (phase) and ``across``
    it, and where it has such columns by ``attitude`` (an angle in radians), ``position`` (a length) and
    ``position_relative``; empty without a reference.
    digits_kept: −log10 of the largest |error|/max(1, |value|) of Ω and γ over the samples; None without a reference.
    against: what it was compared with, and how well that is known.  row: the same as `heavytop score --json`.
    of_digits: decimal digits of the format.  peer: heyoka's own run over the same times in the same format; None
    without a reference, and where heyoka does not get there.  diagnosis: what explains the error, a sentence each.
    passed: whether as many digits are right as were required; None, not a pass, where the run ended early or that
    is not known.
    used: which columns were scored, in a sentence, where these are not Ω and γ in principal axes.
    assessment, needed, sha256: what all of it is made of, the digits required, and the checksum of the file.
    """

    outcome: str
    drift: dict[str, Summary]
    distance: dict[str, Summary]
    digits_kept: float | None
    against: str
    row: Row = field(repr=False)
    of_digits: int
    peer: Peer | None
    diagnosis: tuple[str, ...]
    passed: bool | None
    used: str
    assessment: Assessment = field(repr=False)
    needed: Fraction | None = field(repr=False)
    sha256: str = field(repr=False)

    @property
    def exit_code(self) -> ExitCode:
        """0, 1 where fewer digits are right than were required, 3 where that is not known or the run ended early."""
        if self.passed is None:
            return ExitCode.INCOMPLETE
        return ExitCode.GOOD if self.passed else ExitCode.FINDING

    def to_json(self) -> dict[str, Any]:
        """The document of `score --json`."""
        return to_json(self.assessment) | ({} if self.needed is None else {"passed": self.passed})

    def to_html(self) -> str:
        """The page of `score --html`."""
        from heavytop.features.kinds import KINDS
        from heavytop.report.render.page import report_page

        return report_page(self.report(), KINDS)

    def report(self) -> Report:
        """A report with the row alone, as `score --out` writes it."""
        from heavytop.report.store.store import environment

        return score_report(self.assessment, environment(), self.sha256)

    @property
    def digits_right(self) -> float | None:
        """How many digits are right at every sample."""
        return self.digits_kept

    def _table(self) -> TitledTable:
        row = self.row
        kept = "no reference" if self.row.samples else "no state to score"
        if self.digits_kept is not None:
            kept = f"{digits_text(self.digits_kept)} of {self.of_digits} digits right"
            if self.peer is not None:
                kept += f" ({self.peer.integrator} keeps {digits_text(self.peer.digits_right)})"
        until = f" before t = {short(self.row.reference.until)}" if self.row.reference.until else ""
        sizes = {_LABELS[part] + until: size for part, size in self.distance.items()}
        sizes |= {f"drift of {integral_text(name)}": size for name, size in self.drift.items()}
        title = f"{row.case} in {row.precision}: {self.outcome}, {kept}"
        return TitledTable(
            title,
            _HEADER,
            _lines(sizes),
            [*([self.used] if self.used else []), f"compared with {self.against}", *self.diagnosis],
        )


def score(
    times: Numbers,
    states: Any = None,
    *,
    top: HeavyTop | Body,
    start: State,
    precision: Precision | str | None = None,
    system: System | str | None = None,
    name: str = "given",
    integrator: str = "given",
    require: Number | None = None,
    omega: Any = None,
    omega_space: Any = None,
    gamma: Any = None,
    quaternions: Any = None,
    matrices: Any = None,
    euler: Any = None,
    positions: Any = None,
    quaternion_order: str = "wxyz",
    quaternion: str = "body_to_space",
    matrix: str = "body_to_space",
    sequence: str = "",
    angles: str = "radians",
    up: str = "z",
    pivot: Numbers = (0, 0, 0),
    point: Numbers | None = None,
    normalize: bool = False,
) -> Score:
    """A motion that any program computed, scored like our own.

    Arguments:
        times: shape (n,), exact numbers of one sign, strictly monotone away from 0.
        states: shape (n, 6), in the order Ω1 Ω2 Ω3 γ1 γ2 γ3: an array of float64 or longdouble, or lists of numbers of
            any format, or of decimal, fraction or hexadecimal text.  NaN and infinities are an outcome, not an error.
            None where other arrays fix the motion.
        top, start: what the program was given; rounded to the format first.  A Body has Ω and γ in its own axes.
        precision: the format in which it computed; None for the narrowest that holds every number as it is given.
        system: as in :func:`propagate`.
        name, integrator: what the row is called.
        require: digits that must be right, as ``passed`` of the result says; None asks that the run reached its end.
        omega, omega_space, gamma, positions: shape (n, 3): Ω in body axes, Ω in axes of space, γ, and where ``point``
            (in body axes; the centre of mass if None) stands in the axes of space, the fixed point at ``pivot``.
        quaternions: shape (n, 4), in ``quaternion_order`` "wxyz" or "xyzw"; ``quaternion`` says what they do,
            "body_to_space" or "space_to_body".  matrices: shape (n, 3, 3), ``matrix`` in the same words.
        euler: shape (n, 3), intrinsic angles of ``sequence``, in ``angles`` "radians" or "degrees".
        up: the axis of space that points up: "z", "-z", "y", ...
        normalize: take quaternions, matrices and the start's γ of any length for their directions.

    Returns:
        A :class:`Score`.

    Raises:
        InputError: for an invalid motion, time or number, and for arrays of another shape.
        Contradiction: where two proofs of the known motion exclude each other.
    """
    needed = None if require is None else required(require)
    form = None if precision is None else arguments.precision(precision)
    body = top if isinstance(top, Body) else arguments.is_a(top, HeavyTop, "top")
    about, instants = arguments.system(system, body), list(check_times(times))
    names = arguments.text(name, "name"), arguments.text(integrator, "integrator")
    words = {"quaternion_order": quaternion_order, "quaternion": quaternion, "matrix": matrix, "angles": angles}
    words |= {"sequence": sequence, "up": up}
    words = {word: arguments.text(value, word) for word, value in words.items()}
    given = None if states is None else _rows(states, "states")  # read once: it may be an iterator
    flag = bool(arguments.flag(normalize, "normalize"))
    arrays = columns(
        {
            "omega": omega,
            "omega_space": omega_space,
            "gamma": gamma,
            "quaternion": quaternions,
            "matrix": matrices,
            "euler": euler,
            "position": positions,
        },
        given,
    )
    state = arguments.is_a(start, State, "start")
    where = None if point is None else vector(point, "point")
    said = Convention(**words, pivot=vector(pivot, "pivot"), point=where)
    _require_used(said, {*arrays, *(["attitude"] if state.attitude else [])})
    if given is not None and set(arrays) == {"omega", "gamma"} and isinstance(body, HeavyTop) and not state.attitude:
        _, state = arguments.motion(body, state.normalized() if flag else state)
        return scored(of_arrays(body, state, about, instants, given, form, *names), needed)
    if "euler" in arrays and not said.sequence:
        raise InputError("Euler angles need a sequence.", 'Give sequence, such as "ZXZ" or "ZYX".')
    require_system(about)
    trajectory = of_observed_arrays(body, raw_start(state), said, instants, arrays, form, names, flag)
    return scored(trajectory, needed)


_ARGUMENTS = {"quaternion": "quaternions", "matrix": "matrices", "euler": "euler", "position": "positions"}


def _require_used(convention: Convention, quantities: set[str]) -> None:
    """Raises InputError for a convention, other than by default, of an array that was not given."""
    for word in unused(convention, quantities):
        if word == "up":
            raise InputError("up was given for states in body axes.", "Leave up out: γ points up, in body axes.")
        needed = _ARGUMENTS[USED_BY[word]]
        raise InputError(f"{word} was given without {needed}.", f"Give {needed}, or leave {word} out.")


def read_trajectory(
    path: PathLike, case: str | None = None, *, require: Number | None = None, normalize: bool = False
) -> tuple[GivenTrajectory, Fraction | None]:
    """The arguments of :func:`scored`, from the file of a trajectory (`heavytop docs score`).

    Arguments:
        path: a .json or .csv file; ``-`` for standard input.
        case: a built-in case of its top and start.
        require, normalize: as in :func:`score`.

    Raises:
        InputError: for a file that holds no trajectory, an unknown case, and digits that are not positive.
    """
    from heavytop.cases import case as case_named
    from heavytop.features.score.trajectories.files import read

    needed = None if require is None else required(require)
    about = None if case is None else case_named(arguments.text(case, "case"))
    return read(arguments.path(path, "path"), about, bool(arguments.flag(normalize, "normalize"))), needed


def scored(trajectory: GivenTrajectory, needed: Fraction | None, progress: Callable[[], None] = lambda: None) -> Score:
    """The score of a trajectory of any source.  progress: called twice for each of its states, as they are compared."""
    assessment = assess(trajectory, progress)
    row = assessment.row
    distance = {part: size for part, size in _summaries(row.metrics, SOLUTION_ERROR).items() if part in _PARTS}
    for name, label in ((ATTITUDE_ERROR, "attitude"), (POSITION_ERROR, "position")):
        for part, size in _summaries(row.metrics, name).items():
            distance[f"{label}_{part}" if part else label] = size
    return Score(
        row.outcome,
        _summaries(row.metrics, DRIFT),
        distance,
        digits_kept(row),
        row.against,
        row,
        assessment.of_digits,
        assessment.peer,
        tuple(diagnosis_text(diagnosis, row.system) for diagnosis in assessment.diagnoses),
        passed(row, needed, assessment.cut),
        assessment.used,
        assessment,
        needed,
        trajectory.sha256,
    )


class Drifts(Tabular, dict[str, Summary]):
    """The drift of each first integral by its name."""

    def _table(self) -> TitledTable:
        return TitledTable("Drift of the first integrals", _HEADER, _lines(self))


def _lines(sizes: Mapping[str, Summary]) -> list[list[str]]:
    return [[label, *(short(metric.value) for metric in size)] for label, size in sizes.items()]


def drift(run: Trajectory) -> Drifts:
    """How far the first integrals of a computed motion move from their values at the start.

    Arguments:
        run: what :func:`heavytop.propagate` returned, with its states.

    Returns:
        |I(t) − I(0)| by the name of each integral that holds for the exact top and start, in the units of the
        integral: largest, root mean square and last over the samples.  With an attitude also |ξ|² and ξ·γ.

    Raises:
        InputError: for an invalid trajectory, and for one whose states went to an observer.

    Source:
        (1.3) of the paper, and the integrals of the classical cases.
    """
    if not isinstance(run, Trajectory):
        raise InputError(f"run must be a Trajectory; got {quoted(run)}.", "Give the result of heavytop.propagate.")
    if len(run.states) != len(run.times):
        raise InputError("The states of this run were passed to its observer.", "Propagate without an observer.")
    computed = run.principal or run
    measure = Drift(run.problem, run.problem.integrals())
    carried = computed.attitude is not None
    measure.add_states(numpy.hstack([computed.states, computed.attitude]) if carried else computed.states)
    return Drifts(_summaries(measure.metrics(), DRIFT))


def _summaries(metrics: dict[str, Metric], name: str) -> dict[str, Summary]:
    """Largest, root mean square and last of each component of the quantity of that name."""
    quantities = [metric.quantity for metric in metrics.values() if metric.quantity]
    return {
        quantity.component: Summary(*(metrics[quantity.over(statistic).text] for statistic in Summary._fields))
        for quantity in quantities
        if (quantity.name, quantity.statistic) == (name, "rms")
    }

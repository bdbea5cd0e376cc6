"""Reports with a row of every kind, one that failed, and names that want to be markup."""

from __future__ import annotations

from decimal import Decimal

from heavytop.measure.scalar import of_fraction
from heavytop.precision import exact
from heavytop.records import SCHEMA, Law, Metric, Report, Series
from support.reports import Row, replace

HOSTILE = "<script>window.hacked = 1</script>\"'&$\\frac{a}$\n\x00]]>" + "x" * 10240
TIMES = ["1", "10", "100", "1000"]


def error(value: str) -> Metric:
    return of_fraction(exact(value))


def power(exponent: float, first: float) -> Series:
    """first·t^exponent at TIMES, as decimal text."""
    return Series(TIMES, [str(Decimal(first) * Decimal(time) ** Decimal(exponent)) for time in TIMES])


def row(**changes: object) -> Row:
    """A run of 1000 time units in double, with a law and a band."""
    basis = Row(
        case="euler",
        system="heavy_top",
        integrator="heyoka",
        precision="double",
        bits=53,
        outcome="success",
        horizon="1000",
        time_reached="1000",
        steps=1600,
        finite=True,
        metrics={
            "drift_energy_max": replace(error("3e-15"), band=0.2),
            "solution_error_relative_max": error("1e-10"),
        },
        measure="drift",
        measured="computed: heyoka in double",
        against="known: closed form: Euler-Poinsot",
        series={
            "drift_energy": power(0.5, 9e-17),
            "drift_area": power(0.5, 1e-17),
            "solution_error_along": power(1.5, 1e-16),
            "solution_error_across": power(1.5, 1e-17),
        },
        laws={"solution_error_along": Law("t^1.5", 32, 1.5, 1.4, 1.6, "1", "1000")},
        flags={"tolerance": "2e-16"},
        seconds={"run": 0.1},
    )
    return replace(basis, **changes)


def claim_rows(verdict: str = "refuted") -> list[Row]:
    """Audit, model, evaluation and integration of a claim."""
    text = {"refuted": "0", "holds": "1"}.get(verdict, "unresolved")
    value = Metric(text, 0.0 if verdict == "holds" else None, "value")
    holds = {"(1.1).1 smooth all": Metric("1", 0.0, "value")}
    common = {"horizon": "8", "time_reached": "8", "steps": 0, "laws": {}, "flags": {}, "seconds": {}}
    audit = row(case="c", measure="audit", integrator="audit", precision="exact", bits=0, series={}, **common)
    times = ["0.1", "1", "8"]
    return [
        replace(audit, metrics=holds | {"(1.2).3 smooth all": value}),
        replace(audit, system="gyrostat", metrics=holds),
        row(
            case="c-2/forward",
            measure="claim_model",
            integrator="claim:smooth",
            precision="exact",
            bits=160,
            metrics={"claim_model_error_omega_max": error("0.25"), "claim_parts_by_1_percent_at": error("0.24")},
            series={
                "claim_model_error_omega": Series(times, ["0.0025", "0.17", "0.25"]),
                "claim_model_error_gamma": Series(times, ["0.05", "0.34", "0.05"]),
                "claim_model_error_attitude": Series(times, ["0.05", "1", "2"]),
            },
            **common,
        ),
        row(
            case="c-2/forward",
            measure="claim_evaluation",
            integrator="formula:printed",
            finite=False,
            metrics={},
            series={
                "claim_evaluation_error_omega": Series(["1", "8"], ["1e-16", "1e-12"]),
                "claim_evaluation_error_psi": Series(["1", "2", "8"], ["1e-16", "0", "nan"]),
            },
            **common,
        ),
        row(
            case="c-2/forward",
            measure="homoclinic",
            metrics={"break_away_time": of_fraction(exact("63"), "duration")},
            series={"integration_error_omega": Series(times, ["1e-16", "1e-15", "1e-3"])},
            **(common | {"horizon": "80", "time_reached": "80"}),
        ),
    ]


def work(integrator: str, end: str, seconds: float, **changes: object) -> Row:
    """A run whose largest error is ``end``."""
    value = Metric("missing", None) if end == "missing" else error(end)
    metrics = {"error_final": value, "error_max": value}
    common = {"case": "euler/T=1000", "measure": "work_precision", "series": {}, "laws": {}}
    return row(integrator=integrator, metrics=metrics, seconds={"least": seconds}, **common, **changes)


WORK = [
    work("heyoka tolerance=1e-8", "1e-8", 0.001),
    work("heyoka tolerance=1e-12", "1e-12", 0.004),
    work("peer:A tolerance=1e-9", "1e-8", 0.003),
    work("peer:A tolerance=1e-12", "1e-12", 0.012),
    work("peer:B tolerance=1e-12", "missing", 0.1, outcome="err_nf_state", time_reached="3", finite=False),
]


LONG = [f"{10 ** (1 + 3 * i / 24):.4g}" for i in range(25)]


def law(exponent: float, last: float) -> Series:
    """last·(t/10⁴)^exponent at LONG."""
    return Series(LONG, [f"{last * (float(time) / 1e4) ** exponent:.6e}" for time in LONG])


def method(integrator: str, energy: Series, phase: Series, end: str = "1e-5", **changes: object) -> Row:
    """A long run, of one of the methods whose laws of growth are held side by side."""
    series = {"drift_energy": energy, "solution_error_along": phase}
    made = work(integrator, end, 0.02)
    long = {"case": "lagrange/T=10000", "horizon": "10000", "time_reached": "10000", "series": series}
    return replace(made, **(long | changes))


GROWTH = [
    method("heyoka tolerance=1e-9", law(1, 1e-9), law(2, 1e-5)),
    method("cyrk:DOP853 tolerance=1e-11", law(1, 1e-8), law(2, 1e-5)),
    method("splitting:4 step=1/40", law(0, 1e-8), law(1, 1e-5)),
]


def full_report(name: str = "test") -> Report:
    """Every section of the page has something to show; one run failed, one case has a hostile name."""
    early = row(case="lagrange", outcome="time_limit", time_reached="1", finite=False)
    quad = row(precision="quad", bits=113, metrics={"solution_error_relative_max": error("1e-30")})
    rows = [
        *claim_rows(),
        row(),
        quad,
        early,
        *WORK,
        row(case=HOSTILE, metrics={**row().metrics, HOSTILE: error("1e-997")}),
        *GROWTH,
    ]
    environment = {"packages": {"heavytop": "0.1.0"}, "commit": "0" * 40, HOSTILE: HOSTILE}
    return Report(SCHEMA, {"name": name, "sha256": "0" * 64}, environment, rows)

"""The options of `propagate` and `reference` for the loss of digits and for interpolation between samples."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import typer

from heavytop.errors import InputError, options_named

Ends = Annotated[
    bool,
    typer.Option(
        "--digits-end", help="Also the times by which one rounding error costs the first digit, and all digits."
    ),
]
Between = Annotated[
    str | None,
    typer.Option(
        metavar="DT",
        help="Also the error of interpolation between samples DT apart (reduced to a divisor of the last time).",
    ),
]
Within = Annotated[str | None, typer.Option(metavar="ERROR", help="With --between: the largest DT for this error.")]


class LimitOptions(NamedTuple):
    """See :class:`heavytop.cli.motions.MotionOptions`."""

    digits_end: Ends = False
    between: Between = None
    within: Within = None

    def require(self) -> str:
        """Raises InputError for --within alone."""
        if self.within is not None and self.between is None:
            raise InputError("--within was given without --between.", "Give --between DT too.")
        return "limits" if self.digits_end or self.between is not None else ""

    @options_named({"until": "the last of --times", "spacing": "--between", "within": "--within"})
    def measure(self, top: Any, start: Any, until: Any, **settings: Any) -> Any:
        """The measurements that the options request."""
        from rich.text import Text

        from heavytop.features.limits.between import between_samples
        from heavytop.features.limits.digits_end import digits_end

        system = settings.get("system")
        measured: dict[str, Any] = {}
        if self.digits_end:
            form = settings.get("precision", "double")
            measured["digits_end"] = digits_end(top, start, until, form, system=system)
        if self.between is not None:
            measured["between"] = between_samples(top, start, until, self.between, self.within, system=system)
        return (
            lambda: {name: value.to_json() for name, value in measured.items()},
            lambda: Text("\n" + "\n\n".join(map(str, measured.values()))),
        )

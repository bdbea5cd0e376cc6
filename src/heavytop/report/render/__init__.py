"""Documents on a terminal, on a page, in Markdown and in other formats."""

_EXPORT = "heavytop.report.render.export"
FORMATS = {
    "bencher": f"{_EXPORT}:bencher",
    "github-action-benchmark": f"{_EXPORT}:github_action_benchmark",
    "asv": f"{_EXPORT}:asv",
    "junit": f"{_EXPORT}:junit",
    "csv": f"{_EXPORT}:metrics_csv",
}
"""Formats of `heavytop export`, by name: ``module:function``, called with a report and the kinds, returns the text.

`heavytop export --help`, its errors and :meth:`heavytop.Report.export` take the names from here.
"""

"""A comparison as JUnit XML: one test case a metric, for the test pages of CI systems."""

from __future__ import annotations

from xml.etree import ElementTree

from heavytop.report.compare import Comparison
from heavytop.report.comparison_text import metric_name
from heavytop.report.names import row_name
from heavytop.report.printable import printable
from heavytop.report.verdicts import Verdict

_FAILURE = {Verdict.WORSE}
_ERROR = {Verdict.MISSING, Verdict.INCOMPARABLE}


def comparison_junit(result: Comparison) -> str:
    """Worse is a failure; missing and incomparable are errors; everything else passes."""
    count = result.tally
    suite = ElementTree.Element(
        "testsuite",
        name="heavytop compare",
        tests=str(len(result.findings)),
        failures=str(sum(count.get(verdict, 0) for verdict in _FAILURE)),
        errors=str(sum(count.get(verdict, 0) for verdict in _ERROR)),
        skipped="0",
        time="0",
    )
    properties = ElementTree.SubElement(suite, "properties")
    for name, old, new in result.environment:
        ElementTree.SubElement(properties, "property", name=printable(name), value=printable(f"{old} -> {new}"))
    for finding in result.findings:
        where = f"{finding.row.key.kind}.{row_name(finding.row, with_kind=False)}"
        name = metric_name(finding)
        case = ElementTree.SubElement(suite, "testcase", classname=printable(where), name=printable(name), time="0")
        message = f"{finding.verdict.value}: {finding.baseline or '-'} -> {finding.candidate or '-'}; {finding.reason}"
        if finding.verdict in _FAILURE | _ERROR:
            kind = "failure" if finding.verdict in _FAILURE else "error"
            ElementTree.SubElement(case, kind, message=printable(message), type=finding.verdict.value)
        elif finding.verdict is not Verdict.SAME:
            ElementTree.SubElement(case, "system-out").text = printable(message)
    ElementTree.indent(suite)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(suite, "unicode") + "\n"

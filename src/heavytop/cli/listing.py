"""`list`."""

from __future__ import annotations

from heavytop.cli.app import command


@command
def list_() -> int:
    """List the cases, plans, systems, number formats and integrators that are there."""
    from heavytop.integrate import peers
    from heavytop.precision import FORMATS, available
    from heavytop.suite.cases import CASES
    from heavytop.suite.plan import BUILT_IN

    print("Cases")
    for case in CASES.values():
        print(f"  {case.name:20} {case.system.name:10} {case.about}")
    print(f"Plans\n  {', '.join(BUILT_IN)}, or a TOML file")
    print("Systems\n  heavy_top, gyrostat")
    print("Number formats")
    notes = {form.name: f"{form.bits} bits" for form in FORMATS} | {"real": "24 to 20000 bits"}
    for name, reason in available().items():
        label = "real:BITS" if name == "real" else name
        note = notes[name]
        print(f"  {label:10} {note if reason is None else f'not available: {reason}'}")
    print("Integrators")
    print("  heyoka           every format but double-double")
    print("  words            every format, up to about 1000 bits")
    for name, reason in peers.available().items():
        print(f"  {name:16} {'installed' if reason is None else reason}")
    return 0

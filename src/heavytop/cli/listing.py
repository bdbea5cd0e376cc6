"""`list`."""

from __future__ import annotations

from heavytop.cli.app import command


@command
def list_() -> int:
    """List the cases, plans, systems, number formats and integrators that are there."""
    from heavytop.integrate import peers
    from heavytop.precision import available
    from heavytop.suite.cases import CASES
    from heavytop.suite.plan import BUILT_IN

    print("Cases")
    for case in CASES.values():
        print(f"  {case.name:20} {case.system.name:10} {case.about}")
    print(f"Plans\n  {', '.join(BUILT_IN)}, or a TOML file")
    print("Systems\n  heavy_top, gyrostat")
    print("Number formats")
    for name, reason in available().items():
        label = "real:BITS" if name == "real" else name
        note = {"real": "24 to 20000 bits", "double": "53 bits", "extended": "64 bits", "quad": "113 bits"}[name]
        print(f"  {label:10} {note if reason is None else f'not available: {reason}'}")
    print("Integrators")
    for name, reason in peers.available().items():
        print(f"  {name:15} {'installed' if reason is None else reason}")
    return 0

"""`check-integrator` and `new`."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import Annotated, Any

import typer

from heavytop.cli.app import Json, command, print_json

_WHOLE_WORDS: Any = {"break_long_words": False, "break_on_hyphens": False}


@command
def check_integrator(
    integrator: Annotated[str, typer.Argument(help="A name of `heavytop list`, mine.toml or mine.py:solve.")],
    json: Json = False,
) -> int:
    """Go through the contract of an integrator.

    It says in plain sentences what is wrong.  Exit code 0 if nothing is violated, 1 if something is, 2 if there is no
    such integrator or file.
    """
    from dataclasses import asdict

    from heavytop.api.integrators import check_integrator as check
    from heavytop.cli.output import say_former
    from heavytop.cli.progress import waiting
    from heavytop.former_names import current

    say_former([integrator])
    with waiting("each part of the contract", 60):
        found = check(integrator)
    violated = [each for each in found if each.verdict == "violated"]
    if json:
        verdict = "violated" if violated else "kept"
        print_json({"integrator": current(integrator), "verdict": verdict, "checks": [asdict(each) for each in found]})
    else:
        width = max(len(each.check) for each in found)
        for each in found:
            head = f"{each.verdict:8}  {each.check:{width}}  "
            print(fill(each.text, 80, initial_indent=head, subsequent_indent=" " * len(head), **_WHOLE_WORDS))
        print(f"\n{len(violated)} of {len(found)} violated." if violated else "\nNothing is violated.")
    return 1 if violated else 0


@command
def new(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A new folder.")],
    language: Annotated[str, typer.Option(help="python, c, cpp, rust, julia or fortran.")] = "python",
) -> int:
    """Begin an integrator and its gate in a new folder.

    It holds a program that integrates the heavy top by RK4, in the language asked for.  It works at once: mine.toml
    describes the program, gate.toml is the plan that measures it.
    """
    from heavytop.api.integrators import LANGUAGES, new_integrator

    files = new_integrator(folder, language)
    print(fill(f"{folder}: {', '.join(files)}", 80, subsequent_indent="  ", **_WHOLE_WORDS))
    print(f"Next: cd {folder}; {LANGUAGES[language].build}; heavytop check-integrator mine.toml")
    return 0

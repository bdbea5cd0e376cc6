"""results/public: published numbers of other programs, with the digits of them that are right."""

import json

import pytest

import public_verdicts

FILE = json.loads((public_verdicts.OUT / "verdicts.json").read_bytes())
BRICK = {"sim01": 11.2, "sim02": 4.7, "sim04": 11.2, "sim05": 6.0, "sim06": 4.1}
"""Digits right of five published outputs of one motion, by the four or five digits in which they differ."""


def test_every_published_number_and_log_has_a_verdict() -> None:
    assert [each["name"] for each in FILE["figures"]] == [entry.id for entry in public_verdicts.entries()]
    assert {each["name"] for each in FILE["logs"]} == {path.stem for path in (public_verdicts.OUT / "logs").glob("*")}
    read = {each["read"].removeprefix("github.com/").partition(" at ")[0].partition(";")[0] for each in FILE["figures"]}
    assert len({text.partition(", NESC_data")[0] for text in read}) >= 12


@pytest.mark.slow
@pytest.mark.parametrize("name", ["value-exudyn-lie-10ms", "value-nesc-brick-sim-05", "value-rxode2-rigid-body"])
def test_a_verdict_is_what_the_audit_says(name: str) -> None:
    entry = next(entry for entry in public_verdicts.entries() if entry.id == name)
    assert public_verdicts.verdict(entry) == next(each for each in FILE["figures"] if each["name"] == name)


@pytest.mark.slow
@pytest.mark.parametrize("simulator", BRICK)
def test_the_outputs_of_nasas_brick_have_so_many_digits(simulator: str) -> None:
    made = public_verdicts.log(public_verdicts.OUT / "logs" / f"nesc-brick-{simulator}.csv")
    assert made == next(each for each in FILE["logs"] if each["name"] == f"nesc-brick-{simulator}")
    assert made["digits_right"] == BRICK[simulator]
    assert made["explained_by"] == (["times_shifted"] if simulator == "sim06" else [])


def test_the_page_has_a_row_for_each() -> None:
    page = public_verdicts.page(FILE)
    assert all(f"| {each['name']} |" in page for each in FILE["figures"])
    assert all(f"| {each['name']}.csv |" in page for each in FILE["logs"])

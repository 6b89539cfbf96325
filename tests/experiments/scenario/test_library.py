"""Where scenarios are found by name."""

from __future__ import annotations

import pytest

from experiments.scenario import ScenarioError, catalog, find


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios" / "corridor.toml").write_text("# Question: is it wide?\nseed = 1\n")
    return tmp_path


def test_a_scenario_of_the_package_is_found_by_name(here):
    assert find("output_sync").name == "output_sync.toml"


def test_a_scenario_of_this_folder_is_found_by_name(here):
    assert find("corridor") == here / "scenarios" / "corridor.toml"


def test_a_scenario_here_hides_one_of_the_package(here):
    own = here / "scenarios" / "output_sync.toml"
    own.write_text("")

    assert find("output_sync") == own
    assert [entry.path for entry in catalog() if entry.name == "output_sync"] == [own]


def test_a_path_is_taken_as_it_is(here):
    (here / "mine.toml").write_text("")

    assert str(find("mine.toml")) == "mine.toml"
    assert str(find("./scenarios/corridor.toml")) == "scenarios/corridor.toml"


def test_the_catalog_is_sorted_and_has_the_questions(here):
    entries = catalog()

    assert [entry.name for entry in entries] == sorted(entry.name for entry in entries)
    assert {entry.name: entry.question for entry in entries}["corridor"] == "is it wide?"


@pytest.mark.parametrize(("name", "problem"), [
    ("corridr", 'corridr: no such scenario; did you mean "corridor"?'),
    ("scenarios/coridor.toml", 'scenarios/coridor.toml: no such file; did you mean "scenarios/corridor.toml"?'),
    ("door", 'door: no such scenario; did you mean "door.toml"?'),
    ("dor", 'dor: no such scenario; did you mean "door.toml"?'),
    ("zzzz.toml", 'zzzz.toml: no such file; there is only door.toml'),
    ("door.py", "door.py: this file is no scenario: a scenario is a file whose name ends in .toml"),
    ("nowhere/x.toml", "nowhere/x.toml: no such file; there is no scenario in nowhere"),
])
def test_an_unknown_one_is_refused_with_the_nearest(name, problem, here):
    for file in ("door.toml", "door.py"):
        (here / file).write_text("")

    with pytest.raises(ScenarioError) as error:
        find(name)

    assert error.value.problems == [problem]

"""The page of a view in a real browser, by clicking: it shows a run that happens, and steers it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import load
from netem.records.ledger_file import read_ledger, read_metadata
from tests.browser import Browser, browser, needs_browser
from tests.experiments.run.live.view_bench import Viewed, scenario_in, viewed

pytestmark = needs_browser


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browser(tmp_path_factory.mktemp("profile")) as page:
        yield page


@pytest.fixture
def page(opened: Browser) -> Iterator[Browser]:
    yield opened
    opened.show("data:text/html,<p>")          # so that no page of this test connects again


@pytest.fixture
def shown(tmp_path: Path, page: Browser) -> Iterator[Viewed]:
    """A run of 500 s that the page shows."""
    with viewed(scenario_in(tmp_path, 500.0), tmp_path / "run", "--host", "inline") as running:
        page.show(running.url)
        page.until("RUN.told > 2")
        yield running


def text(page: Browser, selector: str) -> str:
    return str(page.run(f"document.querySelector('{selector}').textContent"))


def place(page: Browser, node: str) -> dict[str, float]:
    """Return where the node is drawn, in pixels of the viewport."""
    found: dict[str, float] = page.run(f"""(() => {{
        document.querySelector('#map').scrollIntoView({{block: 'center', behavior: 'instant'}});
        const box = byId('map').getBoundingClientRect(), spot = MAP.points.get('{node}');
        return {{x: box.x + spot.x, y: box.y + spot.y}};
    }})()""")
    return found


def click_node(page: Browser, node: str) -> None:
    at = place(page, node)
    page.click_at(at["x"], at["y"])


def test_the_map_moves_and_links_fates_ages_and_time_are_shown(page: Browser, shown: Viewed) -> None:
    first, began_ns = place(page, "b"), page.run("RUN.now_ns")
    page.until("RUN.told > 25 && MAP.lit.size > 0")
    later = place(page, "b")

    assert abs(first["x"] - later["x"]) + abs(first["y"] - later["y"]) > 3      # pixels
    assert page.run("RUN.now_ns") > began_ns
    assert text(page, "#name") == "faults"
    assert text(page, "#question") == "what do faults cost?"
    rows = "[...document.querySelectorAll('#link-table tbody tr')]"
    assert page.run(f"{rows}.map((row) => row.cells[0].textContent)") == [
        f"{one} → {other}" for one in "abc" for other in "abc" if one != other]
    assert text(page, "#legend dt") == "delivered"
    assert page.run("Math.abs(ageOf(RUN.counts[0])) < 2e9")
    assert "speaks" in text(page, "#map-card h2")
    assert page.errors == []


@pytest.mark.slow
def test_a_robot_that_is_clicked_is_killed_by_a_button(page: Browser, shown: Viewed, tmp_path: Path) -> None:
    click_node(page, "a")               # it has no position, so it stands still: b may be gone before the click
    assert text(page, "#chosen") == "On a:"
    page.click("#quick [data-kind=kill]")
    page.until("RUN.away.a === 'dead'")
    page.until("byId('events').textContent.includes('injected-0 kill')")
    assert text(page, "#told").startswith("injected-0: kill at ")
    page.until("[...document.querySelectorAll('#legend dt')].some((name) => name.textContent === 'receiver gone')")

    shown.process.terminate()
    shown.process.wait(60)
    fates = {(row["receiver"], row["fate"]) for row in read_ledger(shown.out / "ledger.parquet").to_pylist()}
    assert ("a", "receiver gone") in fates
    assert "injected-0 kill" in [event.detail for event in load_run(shown.out).events if event.kind == "fault"]
    page.until("RUN.ended")
    assert text(page, "#state") == "ended"
    assert "SIGTERM" in text(page, "#notice")


def test_the_form_shows_errors_at_their_fields_and_injects_what_is_right(page: Browser, shown: Viewed) -> None:
    page.run("byId('kind').value = 'link_down'; byId('kind').dispatchEvent(new Event('change'))")
    page.write("#fields [name=lasts_s]", "soon")
    page.click("#inject")
    page.until("document.querySelectorAll('#fields em').length === 2")
    assert page.run("document.querySelector('#fields [name=on] ~ em').textContent") == "on: is missing"
    assert "seconds" in str(page.run("document.querySelector('#fields [name=lasts_s] ~ em').textContent"))
    page.write("#fields [name=on]", "radio: a -> c")
    page.write("#fields [name=lasts_s]", "0.2")
    page.press("Enter")
    page.until("byId('told').textContent.startsWith('injected-0: link_down at ')")

    assert page.run("document.querySelectorAll('#fields em').length") == 0
    page.until("[...document.querySelectorAll('#legend dt')].some((name) => name.textContent === 'cut')")
    assert page.errors == []


def test_the_form_shows_how_groups_are_written_and_what_holds_unless_something_is_chosen(page: Browser,
                                                                                         shown: Viewed) -> None:
    page.run("byId('kind').value = 'partition'; byId('kind').dispatchEvent(new Event('change'))")

    written = page.run("""Object.fromEntries([...document.querySelectorAll('#fields [name]')].map((field) =>
        [field.name, field.options ? field.options[0].textContent : field.placeholder]))""")
    assert written == {"on": "radio", "lasts_s": "to the end of the run", "groups": 'as [["a"], ["b", "c"]]',
                       "shape": "none, if groups are given (unless chosen)", "nodes": 'as ["a"]',
                       "one_way": "false (unless chosen)", "carriers": "cross (unless chosen)"}
    page.write("#fields [name=on]", "radio")
    page.write("#fields [name=groups]", '[["a"], ["b", "c"]]')
    page.click("#inject")
    page.until("byId('told').textContent.startsWith('injected-0: partition at ')")


@pytest.mark.slow
def test_a_pause_stops_virtual_time_and_a_click_on_a_speed_changes_it(page: Browser, shown: Viewed) -> None:
    page.click("#pause")
    page.until("RUN.paused")
    still: Any = page.run("[RUN.now_ns, RUN.told]")
    page.until(f"RUN.told > {still[1]} + 8")
    assert page.run("RUN.now_ns") == still[0]
    assert (text(page, "#state"), text(page, "#pause")) == ("paused", "Go on")

    page.click("#pause")
    page.until(f"RUN.now_ns > {still[0]}")
    page.click("#speeds [data-speed='10']")
    page.until("RUN.wanted === 10")
    page.until("RUN.speed > 2")
    assert page.run("document.querySelector('#speeds [aria-pressed=true]').textContent") == "10×"
    page.click("#speeds [data-speed='']")
    page.until("RUN.wanted === null && RUN.speed > 10")


def test_the_end_is_shown_and_what_was_clicked_repeats_the_run(page: Browser, tmp_path: Path) -> None:
    scenario = scenario_in(tmp_path, 6.0, '[expect]\n"frames_cut" = { max = 0 }\n')
    with viewed(scenario, tmp_path / "run", "--host", "inline", report=True) as shown:
        page.show(shown.url)
        page.until("RUN.told > 2")
        page.run("byId('kind').value = 'link_down'; byId('kind').dispatchEvent(new Event('change'))")
        page.write("#fields [name=on]", "radio: a -> c")
        page.click("#inject")
        page.until("byId('told').textContent.startsWith('injected-0')")
        page.click("#speeds [data-speed='']")
        page.until("RUN.ended")
        said = shown.ends()

    assert "view: the run waits up to 30 s for its page to be opened" in said
    assert f"report: {tmp_path / 'run' / 'report.html'}" in text(page, "#notice")
    assert text(page, "#chosen") == "The run has ended: it takes no more faults."
    assert "expect.frames_cut=" in text(page, "#notice")
    assert page.run("byId('notice').className") == "fails"
    assert page.run("byId('pause').disabled && [...byId('fault').elements].every((part) => part.disabled)")
    assert text(page, "#time") == "6.000 s"
    injected = (shown.out / "injected.toml").read_text()
    scenario.write_text(scenario.read_text().replace("[expect]", f"{injected}[expect]"))
    run(load(scenario), host="inline", out=tmp_path / "again", report=False)
    assert read_metadata(tmp_path / "again" / "ledger.parquet")["hash"] == read_metadata(
        shown.out / "ledger.parquet")["hash"]


def test_a_run_in_real_time_with_a_gateway_shows_how_late_it_is(page: Browser, tmp_path: Path) -> None:
    scenario = scenario_in(tmp_path, 500.0, '[gateways.outside]\nmedium = "radio"\nlisten = "127.0.0.1:0"\n')
    with viewed(scenario, tmp_path / "run", "--host", "inline", "--real-time") as shown:
        page.show(shown.url)
        page.until("RUN.told > 4")

        assert page.errors == []
        names = page.run("[...document.querySelectorAll('#lateness dt')].map((name) => name.textContent)")
        figures = page.run("[...document.querySelectorAll('#lateness dd')].map((figure) => figure.textContent)")
        assert names == ["instants", "median", "99 %", "worst", "overruns"]
        assert all(figure[0].isdigit() for figure in figures), figures
        assert text(page, "#pace") == "in real time"


def test_a_browser_with_a_wrong_token_gets_no_page_and_another_site_no_run(page: Browser, shown: Viewed) -> None:
    page.show("data:text/html,<title>another site</title>")
    answer = page.run(f"""new Promise((done) => {{
        const socket = new WebSocket({shown.live!r});
        socket.onopen = () => done('open');
        socket.onerror = () => done('refused');
    }})""")
    page.show(shown.url[:-4])

    assert answer == "refused"
    assert "the token is missing or wrong" in text(page, "body")


def test_names_in_a_circle_stand_outside_so_that_no_link_crosses_them(page: Browser, tmp_path: Path) -> None:
    scenario = scenario_in(tmp_path, 500.0)
    more = "".join(f"n{k} = {{ parameters = {{ offset_us = {700 * k} }} }}\n" for k in range(5))
    scenario.write_text(scenario.read_text().replace(', v = 0.5 }, plant = { fmu = "unicycle" }', " }")
                        .replace("[media]", f"{more}[media]"))
    with viewed(scenario, tmp_path / "run", "--host", "inline") as shown:
        page.show(shown.url)
        page.until("RUN.told > 4 && RUN.links.length === 56 && MAP.labels.size === 8")

        crossed = page.run("""RUN.links.flatMap(([, sender, receiver]) => {
            const from = MAP.points.get(sender), to = MAP.points.get(receiver);
            const along = [...Array(500).keys()].map((k) => k / 499);
            return [...MAP.labels].filter(([, label]) => along.some((share) => {
                const x = from.x + share * (to.x - from.x), y = from.y + share * (to.y - from.y);
                return label.x < x && x < label.x + label.width && Math.abs(y - label.y) < 7;
            })).map(([name]) => name);
        })""")
        assert crossed == []
        assert page.errors == []


@pytest.mark.slow
def test_many_nodes_are_shown_as_a_matrix(page: Browser, tmp_path: Path) -> None:
    more = "".join(f"n{k} = {{ parameters = {{ offset_us = {700 * k} }}, at_m = [{k * 7 % 10}, {k % 4}] }}\n"
                   for k in range(8))
    scenario = scenario_in(tmp_path, 500.0)
    scenario.write_text(scenario.read_text().replace("[media]", f"{more}[media]"))
    with viewed(scenario, tmp_path / "run", "--host", "inline") as shown:
        page.show(shown.url)
        page.until("RUN.told > 4 && LINKS.cells.length === 110")

        assert page.run("byId('link-table').hidden && !byId('matrix').hidden")
        assert page.run("MAP.points.size") == 11
        page.run("byId('what').value = 'age'; byId('what').dispatchEvent(new Event('change'))")
        page.until("LINKS.cells.length === 110")
        assert page.errors == []

"""A program that names another python-can interface than `marconet`: in its code, the environment, a file, or none."""

from __future__ import annotations

from pathlib import Path

import can
import pytest

from experiments.run.runner import run
from experiments.scenario import load
from firmware_sim.can_interface.other_interfaces import only_our_interface
from netem.wire.errors import NodeFailure

CASE = Path(__file__).parents[2] / "cases" / "can_env_config" / "env.toml"
REMEDY = (r'does not lead to the emulated buses \(node [ab] is on can0\); name "marconet": '
          r'can\.Bus\(interface="marconet", channel="can0"\), or CAN_INTERFACE=marconet in the environment, '
          r"or `interface = marconet` in can\.conf")


def run_with(tmp_path: Path, program: str, real_time: bool = False) -> str:
    scenario = load(CASE, overrides=[f'agents.{name}.program="env:{program}"' for name in "ab"])
    run(scenario, out=tmp_path, report=False, real_time=real_time)
    return (tmp_path / "logs" / "a.log").read_text()


def test_a_name_in_the_code_is_refused_with_the_right_one(tmp_path: Path) -> None:
    with pytest.raises(NodeFailure, match=rf"interface='socketcan' {REMEDY}") as found:
        run_with(tmp_path, "socketcan")

    assert 'in socketcan\n    with can.Bus(interface="socketcan", channel="can0")' in found.value.detail


def test_a_name_in_the_environment_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CAN_INTERFACE", "socketcan")

    with pytest.raises(NodeFailure, match=rf"interface='socketcan' {REMEDY}"):
        run_with(tmp_path, "bare")


def test_a_name_in_a_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / ".canrc").write_text("[default]\ninterface = virtual\nchannel = x\n")
    monkeypatch.setenv("HOME", str(tmp_path))

    with pytest.raises(NodeFailure, match=rf"interface='virtual' {REMEDY}"):
        run_with(tmp_path / "out", "bare")


def test_no_name_at_all_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))

    with pytest.raises(NodeFailure, match="no interface of python-can is named"):
        run_with(tmp_path / "out", "bare")


def test_ours_in_the_environment_opens_the_bus(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CAN_INTERFACE", "marconet")

    assert run_with(tmp_path, "bare") == "opened marconet channel 'can0' of node 'a'\n"


def test_in_real_time_any_interface_may_be_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CAN_INTERFACE", "virtual")
    monkeypatch.setenv("CAN_CHANNEL", "x")

    assert "opened Virtual bus channel x" in run_with(tmp_path, "bare", real_time=True)


def test_detecting_buses_and_other_threads_are_left_alone(robots) -> None:
    found = []

    with only_our_interface():
        robots.alone(lambda: found.extend(can.detect_available_configs(["marconet", "virtual"])))
        can.Bus(interface="virtual", channel="x").shutdown()        # this thread belongs to no program

    assert [config["interface"] for config in found] == ["marconet"]

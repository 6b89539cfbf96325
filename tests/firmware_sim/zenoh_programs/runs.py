"""Runs programs of the folder `programs` in virtual time, and on the library in processes of their own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.run.runner import run
from experiments.scenario import load
from tests.free_port import free_port

PROGRAMS = Path(__file__).with_name("programs")
LAN = '[media.lan]\nkind = "packet_network"\nrate_bps = 10_000_000\ndelay_ms = 1\n'
RADIO = '[media.radio]\nkind = "broadcast_radio"\npreset = "crazyflie_p2p"\nmac = "csma"\n'


def scenario(folder: Path, programs: Mapping[str, str], more: str = LAN, length_s: float = 30.0, seed: int = 1) -> Path:
    """Write a scenario whose agents run these programs, the text of which is found in the folder `programs`."""
    for source in PROGRAMS.glob("*.py"):
        (folder / source.name).write_text(source.read_text())
    lines = [f"seed = {seed}", f"length_s = {length_s}", "node_timeout_s = 20"]
    for name, program in programs.items():
        lines += [f"[agents.{name}]", program if "\n" in program or "=" in program else f'program = "{program}"']
    path = folder / "case.toml"
    path.write_text("# Question: does it?\n" + "\n".join(lines) + "\n" + more)
    return path


def virtually(folder: Path, programs: Mapping[str, str], more: str = LAN, **options: Any) -> dict[str, list[str]]:
    """Return what each program told in a run in virtual time."""
    folder.mkdir(exist_ok=True)
    run(load(scenario(folder, programs, more, **options)), out=folder / "out", report=False)
    return {name: told((folder / "out" / "logs" / f"{name}.log").read_text()) for name in programs}


def really(programs: Mapping[str, str]) -> dict[str, list[str]]:
    """Return what each program told with sessions of the library on the loopback; the first one listens."""
    end_point = [f"tcp/127.0.0.1:{free_port()}"]
    running = {}
    for index, (name, program) in enumerate(programs.items()):
        module, function = program.split(":")
        settings = {"mode": "peer", "scouting/multicast/enabled": False, "scouting/gossip/enabled": False,
                    "listen/endpoints": [] if index else end_point, "connect/endpoints": end_point if index else [],
                    "connect/timeout_ms": 20_000, "connect/retry": {"period_init_ms": 50, "period_max_ms": 50}}
        running[name] = subprocess.Popen(
            [sys.executable, "-c", f"import {module}; {module}.{function}()"], cwd=PROGRAMS, stdout=subprocess.PIPE,
            text=True, env={**os.environ, "ZENOH_PARITY": json.dumps(settings), "PYTHONDONTWRITEBYTECODE": "1"},
            stderr=subprocess.PIPE)
    found, wrong = {}, []
    for name, process in running.items():
        try:
            out, errors = process.communicate(timeout=40)
        except subprocess.TimeoutExpired:
            process.kill()
            out, errors = process.communicate()
            errors += "\nit did not end"
        if process.returncode:
            wrong.append(f"{name}: {out}{errors}")
        found[name] = told(out)
    assert not wrong, "\n".join(wrong)
    return found


def told(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.startswith("TOLD")]


def log_of(folder: Path, name: str) -> str:
    return (folder / "out" / "logs" / f"{name}.log").read_text()

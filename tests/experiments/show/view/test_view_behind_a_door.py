"""The page of a view behind a TLS door in headless Chromium, which shows the certificate of an operator or of none."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.serialization import NoEncryption, load_pem_private_key
from cryptography.hazmat.primitives.serialization.pkcs12 import serialize_key_and_certificates

from netem.gateways.certificate_authority import make_certificates
from tests.browser import browser, needs_browser
from tests.experiments.run.live.view_bench import scenario_in, viewed

pytestmark = [needs_browser, pytest.mark.skipif(
    shutil.which("certutil") is None or shutil.which("pk12util") is None,
    reason="needs certutil and pk12util to give Chromium a certificate: `apt-get install libnss3-tools`")]


def home_with(folder: Path, certificates: Path, name: str) -> Path:
    """Return a home in which Chromium finds the authority and the certificate and key of `name`, if it is not ""."""
    database = folder / ".pki" / "nssdb"
    database.mkdir(parents=True)
    here = ["-d", f"sql:{database}"]
    subprocess.run(["certutil", *here, "-N", "--empty-password"], check=True)
    subprocess.run(["certutil", *here, "-A", "-t", "C,,", "-n", "authority", "-i",
                    str(certificates / "authority.crt")], check=True)
    if name:
        packed = folder / "client.p12"
        key: Any = load_pem_private_key((certificates / f"{name}.key").read_bytes(), None)
        packed.write_bytes(serialize_key_and_certificates(
            name.encode(), key,
            x509.load_pem_x509_certificate((certificates / f"{name}.crt").read_bytes()), None, NoEncryption()))
        subprocess.run(["pk12util", *here, "-i", str(packed), "-W", ""], check=True, stdout=subprocess.DEVNULL)
    return folder


def profile_in(folder: Path) -> Path:
    """Return a profile that shows the certificate it has without asking."""
    exceptions = {"auto_select_certificate": {"https://*,*": {"setting": {"filters": [{}]}}}}
    (folder / "Default").mkdir(parents=True)
    (folder / "Default" / "Preferences").write_text(json.dumps(
        {"profile": {"content_settings": {"exceptions": exceptions}}}))
    return folder


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    make_certificates(tmp_path / "certificates", ["operator"])
    return scenario_in(tmp_path, 500.0, '[network]\ntls = "certificates"\n')


def test_a_browser_with_an_operators_certificate_shows_the_run_and_injects_a_fault(tmp_path, scenario) -> None:
    home = home_with(tmp_path / "home", tmp_path / "certificates", "operator")

    with viewed(scenario, tmp_path / "run", "--host", "inline") as shown, \
            browser(profile_in(tmp_path / "profile"), home) as page:
        page.show(shown.url)
        page.until("RUN.told > 2")
        page.run("byId('kind').value = 'link_down'; byId('kind').dispatchEvent(new Event('change'))")
        page.write("#fields [name=on]", "radio: a -> c")
        page.write("#fields [name=lasts_s]", "0.2")
        page.press("Enter")
        page.until("byId('told').textContent.startsWith('injected-0: link_down at ')")
        page.until("byId('events').textContent.includes(\"whose certificate is operator's\")")

        assert page.run("location.protocol") == "https:"
        assert page.errors == []


def test_a_browser_without_a_certificate_gets_no_page(tmp_path, scenario) -> None:
    home = home_with(tmp_path / "home", tmp_path / "certificates", "")

    with viewed(scenario, tmp_path / "run", "--host", "inline") as shown, \
            browser(profile_in(tmp_path / "profile"), home) as page:
        page.show(shown.url)

        assert page.run("location.protocol") == "chrome-error:"
        assert "ERR_" in page.run("document.body.textContent")

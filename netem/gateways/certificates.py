"""A folder of certificates: who may come through a door of the emulator, and how the emulator shows who it is.

    authority.crt                   whose signature all certificates of the folder have
    emulator.crt, emulator.key      of the emulator, the server of each door
    NAME.crt, NAME.key              of a client: a robot, an operator; common name NAME

    client --TLS 1.3--> door: verified against authority.crt, then its common name is looked up among those it admits

The emulator's certificate names "emulator" as a DNS name, so that a client of ours checks who answers whatever the
address is; for other clients it names the addresses of the doors too. Sessions are not resumed: each connection shows
its certificate, so one that has expired is seen.

Not modelled: revocation. A certificate that is to be refused before it expires needs a new authority.
"""

from __future__ import annotations

import ssl
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

EMULATOR: Final = "emulator"            # the server's certificate, and the name that clients of ours check
AUTHORITY: Final = "authority"
CHECK: Final = "marconet-check"         # ALPN: the client asks for one line, whether it is admitted
LONGEST_NAME: Final = 64                # characters of a common name, as X.520 has it

_EXPIRED, _TOO_EARLY, _OTHER_PURPOSE, _OTHER_NAME = {10}, {9}, {26}, {62, 64}       # OpenSSL's codes of verification
_OTHER_AUTHORITY: Final = {2, 7, 18, 19, 20, 21}
_NO_TLS: Final = {"WRONG_VERSION_NUMBER", "HTTP_REQUEST", "HTTPS_PROXY_REQUEST", "UNKNOWN_PROTOCOL", "BAD_LENGTH",
                  "PACKET_LENGTH_TOO_LONG", "RECORD_LAYER_FAILURE", "RECORD_TOO_SMALL", "UNEXPECTED_MESSAGE",
                  "UNEXPECTED_RECORD", "LENGTH_MISMATCH", "LENGTH_TOO_SHORT", "WRONG_SSL_VERSION",
                  "NOT_TLS", "BAD_RECORD_TYPE", "DATA_LENGTH_TOO_LONG"}
_TOO_OLD: Final = {"UNSUPPORTED_PROTOCOL", "NO_PROTOCOLS_AVAILABLE", "TLSV1_ALERT_PROTOCOL_VERSION"}


class Certificates:
    """The certificates in `folder`. Raises ValueError, with path, rule and remedy, if the emulator's are unusable.

    With `emulators` false it may be the folder of a client's machine, without the emulator's.
    """

    def __init__(self, folder: Path, *, emulators: bool = True) -> None:
        self.folder = folder
        if not folder.is_dir():
            raise ValueError(f"{folder}: is no folder; {self._remedy()}")
        self._read_authority(ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT))
        if emulators:
            self._try_emulator()

    def names(self) -> list[str]:
        """Return the names of the clients with a certificate in the folder."""
        return sorted(path.stem for path in self.folder.glob("*.crt") if path.stem not in (AUTHORITY, EMULATOR))

    def server_context(self) -> ssl.SSLContext:
        """Return the context of a door: a client without a certificate of this authority fails in the handshake."""
        context = self._context(ssl.PROTOCOL_TLS_SERVER, EMULATOR)
        context.verify_mode = ssl.CERT_REQUIRED
        context.num_tickets = 0
        context.set_alpn_protocols([CHECK])
        return context

    def client_context(self, name: str) -> ssl.SSLContext:
        """Return the context of the client `name`, to be used with server_hostname=EMULATOR.

        Raises ValueError as the class does, also for a certificate that has expired.
        """
        context = self._context(ssl.PROTOCOL_TLS_CLIENT, name)
        shows = self._context(ssl.PROTOCOL_TLS_CLIENT, name)        # to a server that needs no certificate of its own
        shows.check_hostname, shows.verify_mode = False, ssl.CERT_NONE
        looks = self._context(ssl.PROTOCOL_TLS_SERVER, name)
        looks.verify_mode = ssl.CERT_REQUIRED
        self._try(name, server=looks, client=shows)
        return context

    # --- files

    def _context(self, protocol: int, name: str) -> ssl.SSLContext:
        context = ssl.SSLContext(protocol)
        context.minimum_version = ssl.TLSVersion.TLSv1_3
        self._read_authority(context)
        self._read_own(context, name)
        return context

    def _read_authority(self, context: ssl.SSLContext) -> None:
        path = self.folder / f"{AUTHORITY}.crt"
        self._look(path)
        try:
            context.load_verify_locations(path)
        except ssl.SSLError:
            raise ValueError(f"{path}: is no certificate in PEM text; {self._remedy(AUTHORITY)}") from None

    def _read_own(self, context: ssl.SSLContext, name: str) -> None:
        certificate, key = self.folder / f"{name}.crt", self.folder / f"{name}.key"
        for path in (certificate, key):
            self._look(path)
        try:
            context.load_cert_chain(certificate, key, password=_no_password)
        except ssl.SSLError as error:
            if error.reason in ("KEY_VALUES_MISMATCH", "KEY_TYPE_MISMATCH"):
                raise ValueError(f"{key}: does not belong to {certificate.name}; {self._remedy(name)}") from None
            wrong = key if self._is_certificate(certificate) else certificate
            kind = "no private key in PEM text without a password" if wrong is key else "no certificate in PEM text"
            raise ValueError(f"{wrong}: is {kind}; {self._remedy(name)}") from None

    def _look(self, path: Path) -> None:
        try:
            with path.open("rb"):
                pass
        except OSError as error:
            if not isinstance(error, FileNotFoundError):
                raise ValueError(f"{path}: cannot be read: {error.strerror}; run as the user that has it") from None
            raise ValueError(f"{path}: is missing; {self._remedy(path.stem, replaces=False)}, or copy it from the "
                             "folder in which it was made") from None

    def _is_certificate(self, path: Path) -> bool:
        try:
            ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT).load_verify_locations(path)
        except ssl.SSLError:
            return False
        return True

    def _remedy(self, name: str = "", *, replaces: bool = True) -> str:
        if name == AUTHORITY:
            return f"put the right one back, or delete the folder and marconet certificates new {self.folder}"
        more = ("" if name in ("", EMULATOR) else f" {name}") + (" --overwrite" if name and replaces else "")
        return f"make new ones with marconet certificates new {self.folder}{more}"

    # --- a handshake in memory tells whether certificates are accepted

    def _try_emulator(self) -> None:
        server = self._context(ssl.PROTOCOL_TLS_SERVER, EMULATOR)
        client = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        self._read_authority(client)
        self._try(EMULATOR, server=server, client=client)

    def _try(self, name: str, *, server: ssl.SSLContext, client: ssl.SSLContext) -> None:
        path = self.folder / f"{name}.crt"
        try:
            certificate = _handshake(server, client)
        except ssl.SSLError as error:
            raise ValueError(f"{path}: {_what_is_wrong(error)}; {self._remedy(name)}") from None
        if name != EMULATOR and common_name(certificate) != name:
            raise ValueError(f"{path}: its common name is {common_name(certificate)!r}; expected the name of the file")


def common_name(certificate: Mapping[str, Any] | None) -> str:
    """Return the common name of a certificate as `getpeercert` gives it; "" if it has none or several."""
    found = [value for part in (certificate or {}).get("subject", ()) for key, value in part if key == "commonName"]
    return str(found[0])[:LONGEST_NAME] if len(found) == 1 else ""


def why_refused(error: BaseException) -> str:
    """Return why the handshake of a client failed at a door, with a remedy, in one clause."""
    if isinstance(error, ssl.SSLCertVerificationError):
        return f"its certificate {_in_words(error)}"
    if isinstance(error, ssl.SSLError):
        reason = error.reason or ""
        if reason == "PEER_DID_NOT_RETURN_A_CERTIFICATE":
            return "it showed no certificate; give it one with its key, from marconet certificates new"
        if reason in _NO_TLS:
            return "it does not speak TLS; connect to this door with tls/ or a client that uses TLS"
        if reason in _TOO_OLD:
            return "it speaks a version of TLS before 1.3; update its TLS library"
        if "_ALERT_" in reason:
            return (f"it does not accept the emulator's certificate ({_alert(reason)}); give it authority.crt of the "
                    "same folder, and a name or address that the emulator's certificate has")
        return f"the TLS handshake failed ({_spelled(reason) or error}); connect with a client that uses TLS 1.3"
    if isinstance(error, (TimeoutError, ConnectionAbortedError)):
        return "it did not finish the TLS handshake in time; connect to this door with a client that uses TLS"
    return "it closed the connection within the TLS handshake; see what its own log says about certificates"


def why_not_admitted(error: BaseException, name: str) -> str:
    """Return what a client of ours, with the certificate of `name`, is told by an error of its connection."""
    if isinstance(error, ssl.SSLCertVerificationError):
        return f"the certificate of the door {_in_words(error)}"
    if isinstance(error, ssl.SSLError):
        reason = error.reason or ""
        for part, why in _ALERTS.items():
            if part in reason:
                return f"the door refuses the certificate of {name}: {why}"
        if reason in _NO_TLS:
            return "what listens there does not speak TLS: it is no door of the emulator"
        return f"the TLS handshake failed ({_spelled(reason) or error})"
    if isinstance(error, ConnectionRefusedError):
        return "nobody listens there: start the run, or correct the address"
    if isinstance(error, TimeoutError):
        return "nobody answers there in time: correct the address, or look whether a firewall is between"
    if isinstance(error, OSError) and error.strerror:
        return f"the connection failed: {error.strerror}"
    return "the door closed the connection without a word: the run's events say why"


_ALERTS: Final = {
    "CERTIFICATE_REQUIRED": "none was shown; name the folder that has it",
    "UNKNOWN_CA": "it is from another authority; use the folder that the run uses",
    "CERTIFICATE_EXPIRED": "it has expired; make new ones with marconet certificates new",
    "BAD_CERTIFICATE": "it cannot be verified; use the folder that the run uses",
    "UNSUPPORTED_CERTIFICATE": "it is not for clients; make new ones with marconet certificates new"}


def _in_words(error: ssl.SSLCertVerificationError) -> str:
    code = error.verify_code
    if code in _EXPIRED:
        return "has expired; make new ones with marconet certificates new"
    if code in _TOO_EARLY:
        return "is not valid yet; set the clocks of both machines"
    if code in _OTHER_AUTHORITY:
        return "is from another authority; use certificates of the folder that the run uses"
    if code in _OTHER_PURPOSE:
        return "is for another purpose; use the certificate of a client at a client, the emulator's at the emulator"
    if code in _OTHER_NAME:
        return f"does not name {EMULATOR!r}; make new ones with marconet certificates new"
    return f"is not accepted ({error.verify_message}); make new ones with marconet certificates new"


def _what_is_wrong(error: ssl.SSLError) -> str:
    """Return what is wrong with a certificate of the folder, without a remedy."""
    if isinstance(error, ssl.SSLCertVerificationError):
        return "is signed by another authority than authority.crt" if error.verify_code in _OTHER_AUTHORITY else \
            _in_words(error).partition(";")[0]
    return f"cannot be used ({_spelled(error.reason or '') or error})"


def _handshake(server: ssl.SSLContext, client: ssl.SSLContext) -> Mapping[str, Any] | None:
    """Return the client's certificate after a handshake in memory. Raises the SSLError of either side."""
    to_server, to_client = ssl.MemoryBIO(), ssl.MemoryBIO()
    there = server.wrap_bio(to_server, to_client, server_side=True)
    here = client.wrap_bio(to_client, to_server, server_hostname=EMULATOR)
    waiting = [here, there]
    while waiting:
        for each in _done(waiting):
            waiting.remove(each)
    return there.getpeercert()


def _done(sides: list[ssl.SSLObject]) -> Iterator[ssl.SSLObject]:
    for side in list(sides):
        try:
            side.do_handshake()
        except ssl.SSLWantReadError:
            continue
        yield side


def _alert(reason: str) -> str:
    return _spelled(reason.partition("_ALERT_")[2])


def _spelled(reason: str) -> str:
    return reason.replace("_", " ").lower()


def _no_password() -> str:
    """Answer OpenSSL, which would ask on the terminal, for the password of a key."""
    return ""

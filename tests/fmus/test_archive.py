"""Archives as tools write them, and archives that would write elsewhere or too much."""

from __future__ import annotations

import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from fmus.archive import unpack
from fmus.describe_fmu import describe
from fmus.errors import PlantError

Archive = dict[str, bytes]


def refusal(path: Path, cache: Path) -> str:
    with pytest.raises(PlantError) as caught:
        describe(path, cache)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def written(path: Path, files: Archive, rename: Callable[[str], str]) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in files.items():
            info = zipfile.ZipInfo("placeholder")
            info.filename = rename(name)            # as it is: ZipInfo would correct it
            archive.writestr(info, data)
    return path


@pytest.mark.parametrize("rename", [lambda name: f"./{name}", lambda name: name.replace("/", "\\"),
                                    lambda name: f".\\{name}".replace("/", "\\")])
def test_other_ways_to_write_the_same_names_load(rename: Callable[[str], str], tmp_path: Path, counter_files: Archive,
                                                 cache: Path) -> None:
    found = describe(written(tmp_path / "a.fmu", counter_files, rename), cache)

    assert found.model_name == "Counter"
    assert Path(found.binary).is_file()


def test_an_outer_folder_is_named(tmp_path: Path, counter_files: Archive, cache: Path) -> None:
    said = refusal(written(tmp_path / "a.fmu", counter_files, lambda name: f"my fmu/{name}"), cache)

    assert said == (f"{tmp_path}/a.fmu: modelDescription.xml lies in the folder my fmu/ of the archive: an FMU has it "
                    "at its top; zip what is in my fmu/, not the folder itself")


@pytest.mark.parametrize("name", ["../evil.so", "binaries/../../evil", "/etc/evil", "C:\\evil", "..\\evil",
                                  "\\\\server\\evil"])
def test_a_name_that_leaves_the_archive_is_refused_and_nothing_is_written_there(
        name: str, tmp_path: Path, counter_files: Archive, cache: Path) -> None:
    folder = tmp_path / "deep" / "down"
    with pytest.raises(PlantError, match="lies outside the archive: a name in an FMU is a path from its top"):
        unpack(written(tmp_path / "a.fmu", counter_files | {name: b"x"}, lambda each: each), folder)

    assert not list(tmp_path.rglob("evil*"))


@pytest.mark.parametrize("identifier", ["../../evil", "a/b", "", "/lib/x", "..\\x"])
def test_a_binary_outside_the_archive_is_refused(identifier: str, pack: Callable[..., Path], counter_files: Archive,
                                                 cache: Path) -> None:
    path = pack(counter_files, replace={'modelIdentifier="counter"': f'modelIdentifier="{identifier}"'})

    assert "would name a binary outside the archive or none" in refusal(path, cache)


def test_an_encrypted_archive_is_refused(pack: Callable[..., Path], counter_files: Archive, cache: Path) -> None:
    path = pack(counter_files)
    data = bytearray(path.read_bytes())
    for signature, place in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        at = data.find(signature)
        while at >= 0:
            struct.pack_into("<H", data, at + place, struct.unpack_from("<H", data, at + place)[0] | 1)
            at = data.find(signature, at + 4)
    path.write_bytes(data)

    assert "modelDescription.xml is encrypted: an FMU has no password" in refusal(path, cache)


def test_more_than_the_stated_size_is_not_unpacked(tmp_path: Path, counter_files: Archive) -> None:
    with zipfile.ZipFile(tmp_path / "a.fmu", "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in (counter_files | {"resources/zeros": bytes(10_000_000)}).items():
            archive.writestr(name, data)
    assert (tmp_path / "a.fmu").stat().st_size < 100_000

    with pytest.raises(PlantError, match=r"a\.fmu: unpacks to more than 0\.00.* GiB"):
        unpack(tmp_path / "a.fmu", tmp_path / "out", most_bytes=5_000_000)

    assert not (tmp_path / "out").exists()


def test_a_file_that_is_larger_than_its_entry_says_is_not_unpacked_whole(tmp_path: Path) -> None:
    """The entry says 10 bytes where 10 MB are packed."""
    path = tmp_path / "a.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", bytes(10_000_000))
    data = bytearray(path.read_bytes())
    struct.pack_into("<I", data, data.find(b"PK\x01\x02") + 24, 10)
    path.write_bytes(data)

    with pytest.raises(PlantError, match=r"not a whole zip archive|unpacks to more than"):
        unpack(path, tmp_path / "out", most_bytes=1_000_000)

    assert sum(file.stat().st_size for file in tmp_path.rglob("out/*")) < 2_000_000


def test_a_document_type_is_refused(pack: Callable[..., Path], cache: Path) -> None:
    xml = ('<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "bbbbbbbb"><!ENTITY c "&b;&b;&b;&b;">]>'
           '<fmiModelDescription fmiVersion="2.0">&c;</fmiModelDescription>')

    assert "declares a document type: an FMU needs none" in refusal(pack({"modelDescription.xml": xml.encode()}), cache)


@pytest.mark.parametrize(("text", "says"), [
    (b"<x/>", "its root is x, expected fmiModelDescription"),
    (b"<fmiModelDescription/>", "it names no fmiVersion"),
    (b"", "no element found: line 1, column 0"),
])
def test_an_xml_file_that_describes_no_model_says_so(text: bytes, says: str, tmp_path: Path, cache: Path) -> None:
    with zipfile.ZipFile(tmp_path / "odd.fmu", "w") as file:
        file.writestr("modelDescription.xml", text)

    assert refusal(tmp_path / "odd.fmu", cache) == (
        f"{tmp_path / 'odd.fmu'}: modelDescription.xml cannot be read: {says}: export it again")

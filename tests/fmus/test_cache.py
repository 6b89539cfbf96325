"""The cache is as it was written, or made again and said so; a cache of others is refused."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from fmus import cache
from fmus.cache import damage_in, kept, why_untrusted
from fmus.errors import PlantError


def make(folder: Path) -> None:
    (folder / "binary").mkdir()
    (folder / "binary" / "model.so").write_bytes(b"the code of a model")
    (folder / "description.json").write_bytes(b"{}")


def cut_off(folder: Path) -> None:
    (folder / "binary" / "model.so").write_bytes(b"the code")


def flip_a_bit(folder: Path) -> None:
    (folder / "binary" / "model.so").write_bytes(b"the code of a nodel")


def remove_a_file(folder: Path) -> None:
    (folder / "description.json").unlink()


def remove_the_list(folder: Path) -> None:
    (folder / cache.FILES).unlink()


def spoil_the_list(folder: Path) -> None:
    (folder / cache.FILES).write_text("nonsense\n")


@pytest.mark.parametrize(("damage", "named"), [
    (cut_off, "binary/model.so has 8 bytes instead of 19"), (flip_a_bit, "binary/model.so was changed"),
    (remove_a_file, "description.json: No such file"), (remove_the_list, ".files: No such file"),
    (spoil_the_list, ".files is not as it was written")])
def test_what_was_damaged_is_named_and_made_again(tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                                  damage: Callable[[Path], None], named: str) -> None:
    folder = kept(tmp_path / "models" / "cart-1", make)
    damage(folder)

    kept(folder, make)

    assert f"{folder}: {named}" in capsys.readouterr().err
    assert (folder / "binary" / "model.so").read_bytes() == b"the code of a model"
    assert damage_in(folder) == ""
    assert [path.name for path in folder.parent.iterdir()] == ["cart-1"]


def test_what_is_whole_is_used_without_a_word(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = kept(tmp_path / "models" / "cart-1", make)

    def never(draft: Path) -> None:
        raise AssertionError

    assert kept(folder, never) == folder
    assert capsys.readouterr().err == ""


def test_a_copied_cache_is_whole_though_its_times_differ(tmp_path: Path) -> None:
    folder = kept(tmp_path / "models" / "cart-1", make)

    os.utime(folder / "description.json", ns=(1, 1))

    assert damage_in(folder) == ""


@pytest.mark.parametrize("level", ["cache", "cache/models", "cache/models/cart-1"])
def test_a_folder_that_others_may_write_to_is_refused(tmp_path: Path, level: str) -> None:
    folder = kept(tmp_path / "cache" / "models" / "cart-1", make)
    (tmp_path / level).chmod(0o777)

    with pytest.raises(PlantError, match=rf"{tmp_path / level}: others may write to it.*chmod go-w it, or set "
                                         "MARCONET_CACHE"):
        kept(folder, make)


def test_a_folder_of_another_user_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = kept(tmp_path / "cache" / "models" / "cart-1", make)
    owner = folder.stat().st_uid
    monkeypatch.setattr(os, "getuid", lambda: owner + 1)

    with pytest.raises(PlantError, match=f"belongs to user {owner}.*set MARCONET_CACHE to a folder of your own"):
        kept(folder, make)


def test_the_group_may_write_where_it_is_the_users_own(tmp_path: Path) -> None:
    tmp_path.chmod(0o775)

    assert why_untrusted(tmp_path) == ""

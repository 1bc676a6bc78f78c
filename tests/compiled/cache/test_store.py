import stat

import numpy as np
import pytest

from clie_blocks.compiled import compile_diagram
from clie_blocks.compiled.cache import store
from clie_blocks.compiled.codegen import machine

DRIVE = {"q_d": [1.0, -0.5]}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("CLIE_BLOCKS_CACHE", str(tmp_path))
    return tmp_path


def final(program):
    return program.run(0.1, step=0.01, inputs=DRIVE).outputs[:, -1]


def test_second_compile_comes_from_the_disk(loop, folder):
    first, second = compile_diagram(loop), compile_diagram(loop)
    assert (first.cached, second.cached) == (False, True)
    np.testing.assert_array_equal(final(first), final(second))


@pytest.mark.parametrize("damage", [
    lambda content: b"", lambda content: content[:40], lambda content: content[:-1],
    lambda content: content[:100] + b"\0" * 50 + content[150:], lambda content: b"x" * 5000])
def test_damaged_file_is_built_again(loop, folder, damage):
    expected = final(compile_diagram(loop))
    (file,) = folder.glob("*.bin")
    file.write_bytes(damage(file.read_bytes()))
    again = compile_diagram(loop)
    assert not again.cached
    np.testing.assert_array_equal(final(again), expected)
    assert compile_diagram(loop).cached


def test_sound_file_with_foreign_code_is_built_again(loop, folder):
    compile_diagram(loop)
    (file,) = folder.glob("*.bin")
    store.save(file.stem, b"not machine code at all")
    again = compile_diagram(loop)
    assert not again.cached
    assert np.all(np.isfinite(final(again)))


def test_another_version_has_another_name(loop, folder, monkeypatch):
    compile_diagram(loop)
    monkeypatch.setattr(machine.llvmlite, "__version__", "99.0")
    assert not compile_diagram(loop).cached
    assert len(list(folder.glob("*.bin"))) == 2


def test_another_diagram_has_another_name(make_block, folder):
    for gain in (1.0, 2.0):
        block = make_block("b", None, lambda t, x, u, params, gain=gain: gain * u + u**2)
        assert not compile_diagram(block).cached


def test_cache_can_be_switched_off(loop, folder, monkeypatch):
    monkeypatch.setenv("CLIE_BLOCKS_CACHE", "off")
    assert not compile_diagram(loop).cached
    assert not compile_diagram(loop).cached
    assert list(folder.iterdir()) == []


def test_cache_that_cannot_be_written_is_no_reason_to_stop(loop, tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    monkeypatch.setenv("CLIE_BLOCKS_CACHE", str(blocked / "below"))
    assert np.all(np.isfinite(final(compile_diagram(loop))))


def test_oldest_programs_are_forgotten(folder, monkeypatch):
    monkeypatch.setattr(store, "KEPT", 3)
    monkeypatch.setattr(store, "CHECKED", 1)
    for k in range(6):
        store.save(store.key(str(k)), b"content")
    assert len(list(folder.glob("*.bin"))) == 3
    assert store.load(store.key("5")) == b"content"


def test_new_folder_is_closed_to_others(loop, tmp_path, monkeypatch):
    monkeypatch.setenv("CLIE_BLOCKS_CACHE", str(tmp_path / "new" / "programs"))
    compile_diagram(loop)
    assert stat.S_IMODE((tmp_path / "new" / "programs").stat().st_mode) == 0o700
    assert compile_diagram(loop).cached


@pytest.mark.parametrize("mode", [0o770, 0o707, 0o1777])
def test_programs_in_a_folder_that_others_can_write_are_not_run(loop, folder, mode, capsys):
    compile_diagram(loop)
    folder.chmod(mode)
    assert not compile_diagram(loop).cached
    assert not compile_diagram(loop).cached
    notes = capsys.readouterr().err.splitlines()
    assert len(notes) == 1 and "can be written by others" in notes[0]
    assert len(list(folder.glob("*.bin"))) == 1


def test_programs_in_a_folder_of_another_user_are_not_run(loop, folder, monkeypatch, capsys):
    compile_diagram(loop)
    monkeypatch.setattr(store.os, "getuid", lambda: folder.stat().st_uid + 1)
    assert not compile_diagram(loop).cached
    assert "belongs to another user" in capsys.readouterr().err

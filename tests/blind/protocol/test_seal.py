"""Seals and the log: the order is enforced, and no change goes unseen."""

import json

import pytest

from clie_blocks.analysis.blind.protocol import seal
from clie_blocks.errors import RecordError

LABELS = {"trial-000": {"kind": "single", "labels": ["coulomb"]}}


def test_labels_cannot_be_read_before_the_diagnoses_are_on_record(tmp_path):
    seal.seal(tmp_path, LABELS)
    assert b"coulomb" not in (tmp_path / seal.SEALED).read_bytes()
    with pytest.raises(RecordError, match="no diagnoses yet"):
        seal.unseal(tmp_path)
    seal.append_event(tmp_path, "diagnosed", digest="0")
    assert seal.unseal(tmp_path) == LABELS
    assert [line["event"] for line in seal.read_log(tmp_path)] == [
        "sealed", "diagnosed", "unsealed"]


def test_other_labels_than_those_committed_to_are_refused(tmp_path):
    seal.seal(tmp_path, LABELS)
    commitment = (tmp_path / seal.LOG).read_text()
    seal.seal(tmp_path, {"trial-000": {"kind": "none", "labels": ["none"]}})
    (tmp_path / seal.LOG).write_text(commitment)
    seal.append_event(tmp_path, "diagnosed", digest="0")
    with pytest.raises(RecordError, match="does not hold the labels committed to"):
        seal.unseal(tmp_path)


def test_of_two_seals_before_the_diagnoses_the_last_counts_and_after_them_none(tmp_path):
    seal.seal(tmp_path, {"trial-000": {"kind": "none", "labels": ["none"]}})
    seal.seal(tmp_path, LABELS)
    seal.append_event(tmp_path, "diagnosed", digest="0")
    assert seal.unseal(tmp_path) == LABELS
    seal.seal(tmp_path, {"trial-000": {"kind": "none", "labels": ["none"]}})
    with pytest.raises(RecordError, match="does not hold the labels committed to"):
        seal.unseal(tmp_path)


def test_a_line_of_the_log_that_was_changed_is_found(tmp_path):
    for event in ("made", "sealed", "diagnosed"):
        seal.append_event(tmp_path, event, count=1)
    rows = (tmp_path / seal.LOG).read_text().splitlines()
    rows[1] = json.dumps({**json.loads(rows[1]), "count": 2})
    (tmp_path / seal.LOG).write_text("\n".join(rows) + "\n")
    with pytest.raises(RecordError, match=r"run\.log:3 does not follow"):
        seal.read_log(tmp_path)


def test_the_digest_of_a_folder_follows_names_and_contents(tmp_path):
    (tmp_path / "a").write_text("1")
    first = seal.folder_digest(tmp_path)
    (tmp_path / "a").rename(tmp_path / "b")
    assert seal.folder_digest(tmp_path) != first

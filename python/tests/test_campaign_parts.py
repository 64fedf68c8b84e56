"""Shards on a Dask cluster: what is refused before anything is run, and how results are put together."""

import os
import sys

import pytest

from cslam.campaign import __main__ as command
from cslam.campaign.merge import Differs, add_counts, put
from cslam.campaign.shard import Task, executable_crc, run

COMMAND = os.environ.get("CSLAM_COMMAND")
FLIGHTS = ["campaign", "--seeds", "1", "2", "--steps", "2"]

with_command = pytest.mark.skipif(COMMAND is None, reason="CSLAM_COMMAND names no cslam")


@with_command
@pytest.mark.parametrize(
    "words, expected",
    [
        (["campaign"], "--out: expected a directory"),
        (["campaign", "--out"], "--out: expected one argument"),
        (["campaign", "--out", "none", "--shard", "0/2"], "--shard: expected no such argument"),
        (["campaign", "--out", "none", "--seeds", "3", "1"], "nothing to fly"),
        (["campaign", "--out", "none", "--scenes", "nowhere.json"], "nowhere.json"),
        (["campaign", "--out", "none", "--sideways"], "--sideways"),
        (["dataset", "--out", "none", "--shards", "0"], "--shards 0: expected a whole number, 1 to 9999"),
        (["--workers", "none", "campaign", "--out", "none"], "--workers none: expected a whole number, 1 to 1000"),
        (["--retries", "-1", "campaign", "--out", "none"], "--retries -1: expected a whole number, 0 to 100"),
        (["--command", "no-such-cslam", "campaign", "--out", "none"], "--command no-such-cslam: expected the cslam command"),
        (["--workers", "1", "--scheduler", "tcp://127.0.0.1:1", "campaign"], "not allowed with argument"),
        (["fly"], "invalid choice: 'fly'"),
    ],
)
def test_wrong_arguments_are_refused_by_name(tmp_path, monkeypatch, capsys, words, expected):
    monkeypatch.chdir(tmp_path)
    own = [] if "--command" in words else ["--command", COMMAND]
    try:
        code = command.main([*own, *words])
    except SystemExit as end:
        code = end.code
    assert code == 2 and expected in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@with_command
def test_an_address_without_a_scheduler_is_refused(tmp_path, monkeypatch, capsys):
    pytest.importorskip("distributed", reason="Dask is not installed: the extra campaign")
    monkeypatch.setattr("cslam.campaign.cluster.ANSWER_S", 1)
    words = ["--command", COMMAND, *FLIGHTS, "--out", str(tmp_path / "none")]
    for address in ("tcp://127.0.0.1:1", "nowhere"):
        assert command.main(["--scheduler", address, *words]) == 2
        assert f"--scheduler {address}: expected the address of a Dask scheduler" in capsys.readouterr().err


@with_command
def test_without_dask_the_extra_is_named(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert command.main(["--command", COMMAND, *FLIGHTS, "--out", str(tmp_path / "none")]) == 2
    said = capsys.readouterr().err
    assert "Dask is not installed" in said and "extra campaign" in said and "./python[campaign]" in said


@with_command
def test_another_build_of_the_command_runs_no_shard(tmp_path):
    task = Task(COMMAND, executable_crc(COMMAND) ^ 1, ("campaign",), str(tmp_path))
    with pytest.raises(OSError, match="is another build"):
        run(task, 0, 1)
    with pytest.raises(FileNotFoundError, match="no-such-cslam: no such program"):
        executable_crc("no-such-cslam")


def contents(directory):
    return {file.relative_to(directory).as_posix(): file.read_bytes() for file in directory.rglob("*") if file.is_file()}


def test_parts_add_up_in_any_order(tmp_path):
    a, b, c = {"links": 3, "paths": 7}, {"links": 5, "paths": 0}, {"links": 1, "paths": 2}
    assert add_counts(add_counts(a, b), c) == add_counts(a, add_counts(c, b)) == {"links": 9, "paths": 9}
    shards = [{"dataset.json": b"{}", f"shard-{n}/a.npy": bytes([n]), f"shard-{n}/deep/b.npy": b""} for n in range(3)]
    for name, order in (("there", shards), ("back", shards[::-1] + shards[:1])):
        for files in order:
            put(tmp_path / name, files, "dataset.json")
    there, back = (contents(tmp_path / name) for name in ("there", "back"))
    assert there == back and len(there) == 7
    assert (tmp_path / "back" / "shard-2" / "a.npy").read_bytes() == b"\x02"
    with pytest.raises(Differs, match="describes another data set"):
        put(tmp_path / "back", {"dataset.json": b"[]", "shard-9/a.npy": b""}, "dataset.json")
    assert not (tmp_path / "back" / "shard-9").exists()

"""Shards on a Dask cluster: one process bit for bit, whoever is lost, and what is said of those that fail."""

import json
import os
import signal
import stat
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

COMMAND = os.environ.get("CSLAM_COMMAND")
FLIGHTS = ["campaign", "--world", "budget", "--seeds", "1", "3", "--steps", "2"]
#: Longer than anything takes here: it ends a test that would wait for ever.
PATIENCE_S = 300

with_command = pytest.mark.skipif(COMMAND is None, reason="CSLAM_COMMAND names no cslam")


@pytest.fixture(scope="module")
def one_process(tmp_path_factory):
    """The campaign by one process: its directory, and what it prints."""
    out = tmp_path_factory.mktemp("one") / "flights"
    ended = subprocess.run([COMMAND, *FLIGHTS, "--out", out], check=True, capture_output=True, text=True)
    return out, ended.stdout


@pytest.fixture
def started():
    """Starts a process that does not outlive the test, in a session of its own: what it has begun ends with it."""
    processes = []

    # In a job in the background Ctrl-C is ignored, and what it starts would inherit that.
    heed_interrupts = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)  # noqa: E731

    def start(*words, **options):
        process = subprocess.Popen(
            [str(word) for word in words], start_new_session=True, preexec_fn=heed_interrupts, **options
        )
        processes.append(process)
        return process

    yield start
    for process in processes:
        try:
            os.killpg(process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        process.wait()


@pytest.fixture
def scheduler(started, tmp_path):
    """The address of a scheduler without workers, which this machine alone can reach."""
    pytest.importorskip("distributed", reason="Dask is not installed: the extra campaign")
    file = tmp_path / "scheduler.json"
    started(
        *(sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"),
        *("--dashboard-address", "127.0.0.1:0", "--no-show", "--scheduler-file", file),
        stderr=subprocess.DEVNULL,
    )
    wait_for(lambda: file.exists() and file.read_text().strip().endswith("}"))
    return json.loads(file.read_text())["address"]


def worker(started, scheduler, tmp_path):
    """A worker of one thread; its process is the one that runs shards."""
    return started(
        *(sys.executable, "-m", "distributed.cli.dask_worker", scheduler, "--nthreads", "1", "--no-nanny", "--no-dashboard"),
        *("--host", "127.0.0.1", "--memory-limit", "0", "--local-directory", tmp_path / "workers"),
        stderr=subprocess.DEVNULL,
    )


def wait_for(condition):
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, "waited for too long"
        time.sleep(0.02)


def script(file: Path, body: str) -> Path:
    """A command in the stead of `cslam`: of a shard, ``body`` decides first, which knows its ``shard`` ("1/3"); what it leaves is done."""
    head = f"""\
        #!{sys.executable}
        import os, sys, time
        from pathlib import Path
        at = Path({str(file.parent)!r})
        words = sys.argv[1:]
        shard = words[words.index("--shard") + 1] if "--shard" in words else ""
    """
    tail = f"os.execv({COMMAND!r}, [{COMMAND!r}, *words])\n"
    file.write_text(textwrap.dedent(head) + textwrap.dedent(body) + tail)
    file.chmod(file.stat().st_mode | stat.S_IXUSR)
    return file


def cslam_campaign(*words):
    return [sys.executable, "-m", "cslam.campaign", *map(str, words)]


def ended(*words, **settings):
    environment = {**os.environ, **{f"DASK_DISTRIBUTED__{name}": value for name, value in settings.items()}}
    return subprocess.run(cslam_campaign(*words), capture_output=True, text=True, timeout=PATIENCE_S, check=False, env=environment)


def contents(out: Path) -> dict[str, bytes]:
    """Every file, with flights' reports without the time that computing took."""
    files = {file.relative_to(out).as_posix(): file.read_bytes() for file in out.rglob("*") if file.is_file()}
    for name, content in files.items():
        if name.endswith(".json") and name != "summary.json" and b"elapsed_s" in content:
            lines = content.splitlines(keepends=True)
            files[name] = b"".join(line for line in lines if b'"elapsed_s"' not in line)
    return files


def assert_equal(ours: Path, theirs: Path):
    ours, theirs = contents(ours), contents(theirs)
    assert ours.keys() == theirs.keys()
    assert [name for name in ours if ours[name] != theirs[name]] == []


@with_command
def test_a_campaign_on_a_cluster_is_that_of_one_process_and_goes_on_where_it_was(tmp_path, one_process):
    pytest.importorskip("distributed", reason="Dask is not installed: the extra campaign")
    out = tmp_path / "flights"
    words = ("--workers", "2", "--command", COMMAND, *FLIGHTS, "--out", out)
    first = ended(*words)
    assert first.returncode == 0, first.stderr
    directory, printed = one_process
    assert first.stdout == printed
    assert_equal(out, directory)
    assert "3 shards on 2 workers, 2 at a time" in first.stderr and "done, 3 of 3" in first.stderr
    # What is there is not flown again: nothing is asked of a cluster.
    lost = out / "budget.best.outdoor.2.json"
    lost.unlink()
    written = {file.name: file.stat().st_mtime_ns for file in out.glob("budget.*")}
    again = ended(*words)
    assert again.returncode == 0 and "1 shards on 2 workers" in again.stderr and "shard 1/3: done, 1 of 1" in again.stderr
    assert written.items() <= {file.name: file.stat().st_mtime_ns for file in out.glob("budget.*")}.items()
    assert_equal(out, directory)
    whole = ended("--scheduler", "tcp://127.0.0.1:1", "--command", COMMAND, *FLIGHTS, "--out", out, "--json")
    assert whole.returncode == 0 and json.loads(whole.stdout) == json.loads((out / "summary.json").read_text())


@with_command
def test_a_data_set_on_a_cluster_is_that_of_one_process(tmp_path):
    pytest.importorskip("distributed", reason="Dask is not installed: the extra campaign")
    words = ("dataset", "--rate", "0.0001", "--transmitters", "3", "--shards", "3")
    theirs = subprocess.run([COMMAND, *words, "--out", tmp_path / "one", "--json"], check=True, capture_output=True, text=True)
    ours = ended("--workers", "2", "--command", COMMAND, *words, "--out", tmp_path / "shards")
    assert ours.returncode == 0, ours.stderr
    assert ours.stdout == theirs.stdout
    assert json.loads(ours.stdout)["links"] > 10
    assert_equal(tmp_path / "shards", tmp_path / "one")
    other = ended("--workers", "1", "--command", COMMAND, *words, "--seed", "2", "--out", tmp_path / "shards")
    assert other.returncode == 2 and "describes another data set" in other.stderr
    assert_equal(tmp_path / "shards", tmp_path / "one")


@with_command
def test_a_shard_whose_worker_is_killed_is_run_again_and_the_result_is_the_same(tmp_path, started, scheduler, one_process):
    # The first to run shard 1 says by whom, and waits until that one is gone.
    held = script(
        tmp_path / "held",
        """
        if shard == "1/3":
            try:
                place = os.open(at / "held-by", os.O_CREAT | os.O_EXCL | os.O_WRONLY)
            except FileExistsError:
                (at / "run-again").touch()
            else:
                parent = os.getppid()
                os.write(place, b"%d." % parent)
                while os.getppid() == parent:
                    time.sleep(0.02)
                sys.exit(1)
        """,
    )
    workers = [worker(started, scheduler, tmp_path) for _ in range(2)]
    out, said = tmp_path / "flights", tmp_path / "said"
    with said.open("w") as log:
        campaign = started(
            *cslam_campaign("--scheduler", scheduler, "--command", held, *FLIGHTS, "--out", out), stdout=subprocess.DEVNULL, stderr=log
        )
    wait_for(lambda: (tmp_path / "held-by").exists() and (tmp_path / "held-by").read_text().endswith("."))
    holder = int((tmp_path / "held-by").read_text().rstrip("."))
    (killed,) = [process for process in workers if process.pid == holder]
    killed.kill()
    assert campaign.wait(PATIENCE_S) == 0, said.read_text()
    assert (tmp_path / "run-again").exists() and killed.wait(PATIENCE_S) == -signal.SIGKILL
    assert_equal(out, one_process[0])


@with_command
def test_a_shard_that_always_fails_is_given_up_by_its_number_and_the_others_stay(tmp_path, started, scheduler, one_process):
    failing = script(
        tmp_path / "failing",
        """
        if shard == "1/3":
            with open(at / "attempts", "a") as attempts:
                attempts.write("x")
            sys.exit("cslam: the sky has fallen")
        """,
    )
    worker(started, scheduler, tmp_path)
    out = tmp_path / "flights"
    words = ("--scheduler", scheduler, "--command", failing, "--retries", "1", *FLIGHTS, "--out", out)
    given_up = ended(*words)
    assert given_up.returncode == 1, given_up.stderr
    assert given_up.stderr.splitlines()[-1] == "error: shard 1/3: exit code 1: cslam: the sky has fallen"
    assert "tried again (1 of 1)" in given_up.stderr and "given up after 2 attempts" in given_up.stderr
    assert (tmp_path / "attempts").read_text() == "xx"
    assert {file.name for file in out.iterdir()} == {"budget.best.outdoor.1.json", "budget.best.outdoor.3.json"}
    theirs = contents(one_process[0])
    assert all(theirs[name] == content for name, content in contents(out).items())


@with_command
def test_a_shard_that_takes_every_worker_with_it_or_leaves_nothing_is_named(tmp_path, one_process):
    pytest.importorskip("distributed", reason="Dask is not installed: the extra campaign")
    # Shard 1 ends the worker that runs it, shard 2 says that all is well.
    poison = script(
        tmp_path / "poison",
        f"""
        if shard == "1/3":
            os.kill(os.getppid(), {int(signal.SIGKILL)})
        if shard in ("1/3", "2/3"):
            sys.exit()
        """,
    )
    out = tmp_path / "flights"
    words = ("--workers", "1", "--retries", "1", "--command", poison, *FLIGHTS, "--out", out)
    lost = ended(*words, SCHEDULER__ALLOWED_FAILURES="0")
    assert lost.returncode == 1, lost.stderr
    assert lost.stderr.splitlines()[-1].startswith("error: shard 1/3: its workers were lost"), lost.stderr
    assert "shard 2/3: done, 2 of 3" in lost.stderr and "given up after 2 attempts" in lost.stderr
    assert [file.name for file in out.iterdir()] == ["budget.best.outdoor.1.json"]
    (out / "budget.best.outdoor.2.json").write_bytes((one_process[0] / "budget.best.outdoor.2.json").read_bytes())
    nothing = ended(*words)
    assert nothing.returncode == 1 and nothing.stderr.splitlines()[-1] == "error: shard 2/3: left no flight", nothing.stderr


@with_command
def test_an_interrupted_campaign_keeps_what_has_arrived(tmp_path, started, scheduler, one_process):
    held = script(
        tmp_path / "held",
        """
        if shard == "1/3":
            (at / "begun").touch()
            parent = os.getppid()
            while os.getppid() == parent:
                time.sleep(0.02)
        """,
    )
    worker(started, scheduler, tmp_path)
    out = tmp_path / "flights"
    campaign = started(
        *cslam_campaign("--quiet", "--scheduler", scheduler, "--command", held, *FLIGHTS, "--out", out), stderr=subprocess.PIPE, text=True
    )
    first = out / "budget.best.outdoor.1.json"
    wait_for(lambda: (tmp_path / "begun").exists() and first.exists())
    campaign.send_signal(signal.SIGINT)
    _, said = campaign.communicate(timeout=PATIENCE_S)
    assert campaign.returncode == 130 and said.splitlines()[-1] == "interrupted: what has arrived stays"
    assert contents(out).items() <= contents(one_process[0]).items()


@with_command
def test_arguments_that_a_shard_refuses_end_the_run_without_another_attempt(tmp_path, started, scheduler):
    worker(started, scheduler, tmp_path)
    refused = ended("--scheduler", scheduler, "--command", COMMAND, "dataset", "--scene", "nowhere.json", "--out", tmp_path / "none")
    assert refused.returncode == 2 and "nowhere.json" in refused.stderr.splitlines()[-1], refused.stderr
    assert "tried again" not in refused.stderr

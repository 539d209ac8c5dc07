"""Messages, logged subprocesses and the one error type of the set-up."""

from __future__ import annotations

import contextlib
import ctypes
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

NETWORK_SIGNS = re.compile(
    r"name resolution|NewConnectionError|ConnectTimeout|ReadTimeout|Read timed out|ProxyError|"
    r"Connection refused|Connection reset|Network is unreachable|RemoteDisconnected|SSLError|"
    r"Could not resolve|Failed to fetch|Temporary failure"
)
DISK_SIGNS = re.compile(r"No space left on device|ENOSPC|Disk quota exceeded|not enough free space")
PR_SET_PDEATHSIG = 1


class SetupError(Exception):
    """A set-up step failed; the message is one sentence for the user."""


class Console:
    """Prints the progress of the steps on standard error, so that a command's output stays clean.

    On a terminal the current line is rewritten; elsewhere a line is printed when a step starts and
    ends, and every ten seconds in between.
    """

    def __init__(self) -> None:
        self._terminal = sys.stderr.isatty()
        self._title = ""
        self._started = 0.0
        self._last_shown = 0.0

    def start(self, title: str) -> None:
        self._title = title
        self._started = self._last_shown = time.monotonic()
        self._write(f"{title} ...", final=not self._terminal)

    def update(self, detail: str) -> None:
        now = time.monotonic()
        if now - self._last_shown < (0.1 if self._terminal else 10.0):
            return
        self._last_shown = now
        self._write(f"{self._title}: {detail}", final=not self._terminal)

    def done(self) -> None:
        seconds = time.monotonic() - self._started
        self._write(f"{self._title}: done in {seconds:.1f} s", final=True)

    def _write(self, text: str, final: bool) -> None:
        text = "".join(c if c.isprintable() else " " for c in text)
        if self._terminal:
            width = shutil.get_terminal_size().columns - 1
            sys.stderr.write(f"\r\x1b[K{text[:width]}" + ("\n" if final else ""))
        else:
            sys.stderr.write(text + "\n")
        sys.stderr.flush()


def _die_with_parent() -> None:
    """In a child: be killed when ./run is, so that nothing writes behind a second ./run's back."""
    ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def run_logged(
    command: Sequence[str | Path],
    *,
    console: Console,
    log: Path,
    failure: str,
    environment: Mapping[str, str] | None = None,
    keep_open: Sequence[int] = (),
) -> None:
    """Runs a command, its output appended to `log` and its last line shown as progress.

    Raises SetupError with `failure`, the reason where it is a known one, and the log's path.
    """
    log.parent.mkdir(parents=True, exist_ok=True)
    tail: list[str] = []
    with log.open("a", encoding="utf-8", buffering=1) as sink:
        sink.write(f"$ {' '.join(map(str, command))}\n")
        try:
            process = subprocess.Popen(
                [str(part) for part in command],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                errors="replace",
                env=dict(os.environ if environment is None else environment),
                pass_fds=tuple(keep_open),
                process_group=0,
                preexec_fn=_die_with_parent,
            )
        except OSError as error:
            raise SetupError(f"{failure}: {command[0]}: {error.strerror}.") from error
        assert process.stdout is not None
        try:
            for line in process.stdout:
                line = line.rstrip()
                progress = re.fullmatch(r"Progress (\d+) of (\d+)", line)
                if progress:
                    got, total = (int(number) for number in progress.groups())
                    if total > 0:
                        console.update(f"{100 * got // total} % of {total / 1e6:.0f} MB")
                    continue
                sink.write(line + "\n")
                if line:
                    tail = [*tail[-60:], line]
                    console.update(line.strip())
            status = process.wait()
        except BaseException:
            _end_group(process)
            raise
    if status != 0:
        raise SetupError(f"{failure}: {_reason(tail, status)} (all output: {log}).")


def _end_group(process: subprocess.Popen[str]) -> None:
    """Ends a child and all that it started."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, number)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(timeout=5)


def _reason(tail: list[str], status: int) -> str:
    text = "\n".join(tail)
    if DISK_SIGNS.search(text):
        return "the disk is full; free some space and run it again"
    if NETWORK_SIGNS.search(text):
        return "the network or the package registry cannot be reached; check it and run it again"
    errors = [line for line in tail if re.search(r"error|fatal|^E:", line, re.IGNORECASE)]
    last = (errors or tail or [f"it ended with status {status}"])[0 if errors else -1]
    return last.strip()


def require_disk(directory: Path, megabytes: int, what: str) -> None:
    """Raises SetupError unless `directory`'s disk has that much free."""
    free = shutil.disk_usage(directory).free // 1_000_000
    if free < megabytes:
        raise SetupError(
            f"{what} needs {megabytes} MB free in {directory}, which has {free} MB; "
            "free some space and run it again."
        )

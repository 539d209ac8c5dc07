"""``./run COMMAND...``: sets up what is missing, then becomes COMMAND.

Own commands are ``test``, ``lint``, ``mbfeat`` and ``usdrecord``; anything else is looked up on
PATH. ``training COMMAND...`` runs it in the environment that has PyTorch. With MBFEAT_SKIP_BUILD
set, an existing build is used as it is.
"""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from types import FrameType
from typing import NoReturn

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from mbfeat.devtools import environment, steps, training_steps
from mbfeat.devtools.console import Console, SetupError
from mbfeat.devtools.layout import Layout, this_layout

TRAINING = "training"
TASKS = ("test", "sanitize", "lint")
USAGE = """\
usage: ./run COMMAND [ARGUMENT...]
Sets up what is missing, then runs COMMAND in the project's environment. Among others:
  ./run usdrecord --renderer MBFeat STAGE IMAGE   render a stage
  ./run mbfeat --help                             the project's own command
  ./run test [--cpp | --python] [PYTEST-OPTION...]   run the tests
  ./run sanitize                                  run the C++ tests under the sanitizers
  ./run lint [--fix]                              check format, style and types
  ./run training COMMAND [ARGUMENT...]            run COMMAND where PyTorch is, installed on demand
"""


def main(arguments: list[str]) -> int:
    if not arguments or arguments[0] in ("-h", "--help"):
        sys.stderr.write(USAGE)
        return 0 if arguments else 2
    layout = this_layout()
    training = arguments[0] == TRAINING
    if training:
        arguments = arguments[1:] or ["true"]
    wanted: list[type[steps.Step]] = list(steps.ALWAYS)
    if arguments[0] == "lint":
        wanted += steps.FOR_LINT
    if training:
        wanted.append(training_steps.TrainingEnvironment)
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, _interrupt)
    try:
        set_up(layout, wanted)
    except SetupError as error:
        sys.stderr.write(f"run: {error}\n")
        return 1
    except OSError as error:
        sys.stderr.write(f"run: set-up failed: {error.strerror}: {error.filename}.\n")
        return 1
    except KeyboardInterrupt:
        sys.stderr.write("\nrun: interrupted; run it again to go on.\n")
        return 130
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    return become(layout, arguments, layout.training if training else layout.venv)


def set_up(layout: Layout, wanted: list[type[steps.Step]]) -> None:
    """Runs the steps that are not done; raises SetupError at the first that fails."""
    if os.environ.get("MBFEAT_SKIP_BUILD"):
        wanted = [step for step in wanted if step is not steps.Build]
    console = Console()
    if all(step(layout, console).is_done() for step in wanted):
        return
    import fcntl

    layout.made.mkdir(parents=True, exist_ok=True)
    with (layout.made / "lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            sys.stderr.write("run: waiting for another ./run in this checkout ...\n")
            fcntl.flock(lock, fcntl.LOCK_EX)
        for number, kind in enumerate(wanted, 1):
            step = kind(layout, console, (lock.fileno(),))
            if not step.is_done():
                console.start(f"[{number}/{len(wanted)}] {step.title}")
                step.run()
                console.done()


def become(layout: Layout, arguments: list[str], venv: Path) -> NoReturn:
    """Replaces this process by the command, in the virtual environment `venv`."""
    variables = environment.for_runtime(layout, os.environ, venv)
    command = arguments
    if arguments[0] in TASKS:
        command = [str(venv / "bin" / "python"), "-m", "mbfeat.devtools.tasks", *arguments]
    sys.stdout.flush()
    sys.stderr.flush()
    try:
        os.execvpe(command[0], command, variables)
    except OSError as error:
        sys.stderr.write(f"run: {command[0]}: {error.strerror}.\n")
        sys.exit(127 if isinstance(error, FileNotFoundError) else 126)


def _interrupt(number: int, frame: FrameType | None) -> NoReturn:
    raise KeyboardInterrupt


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""One render by usdrecord, and how long each part of it took.

    python -m mbfeat.tradeoff.child STATISTICS USDRECORD-ARGUMENT...

writes the renderer's statistics as JSON to the file STATISTICS, with the clock at the end and the
seconds that writing the image took, which the statistics do not hold.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import Any


def clock() -> float:
    """Seconds of a clock that all processes of the machine share."""
    return time.clock_gettime(time.CLOCK_MONOTONIC)


def main(arguments: list[str]) -> int:
    """Renders; returns usdrecord's exit code."""
    from mbfeat.runtime import use_runtime

    use_runtime()
    from mbfeat import _core, recorder, usdrecord

    written = [0.0]
    write_image = recorder.write_image

    def timed(*what: Any) -> None:
        started = clock()
        write_image(*what)
        written[0] += clock() - started

    setattr(recorder, "write_image", timed)  # noqa: B010
    code = usdrecord.main(arguments[1:])
    finished = clock()
    frame = _core.Host.last_frame()
    if code == 0 and frame is not None:
        content = {
            "finished": finished,
            "image": written[0],
            "statistics": json.loads(frame.report.json()),
        }
        Path(arguments[0]).write_text(json.dumps(content), encoding="utf-8")
    return code


if __name__ == "__main__":
    status = main(sys.argv[1:])
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)  # see mbfeat.usdrecord.command

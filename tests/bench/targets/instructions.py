"""Instructions that targets of error and time cost renders that have none.

    ./run python tests/bench/targets/instructions.py

Renders a small room to fixed counts under valgrind's callgrind, by the renderer as it is and by one
that was compiled without target error, time limit and adaptive sampling. The instructions of few
samples are subtracted from those of many, so that what is left is the sampling. Needs valgrind
(Debian package of that name).
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

FEW, MANY = 16, 80
LIMIT = 1.01  # as of effects that are absent


def count(program: Path, samples: int) -> tuple[int, str]:
    """Instructions of a render, and its mean colour."""
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"]
    answer = subprocess.run(
        [*command, str(program), str(samples)], capture_output=True, text=True, check=False
    )
    counted = re.search(r"Collected : (\d+)", answer.stderr)
    if answer.returncode != 0 or counted is None:
        raise SystemExit(f"{program.name} failed:\n{answer.stderr}")
    return int(counted[1]), answer.stdout.strip()


def main() -> int:
    """Measures and prints; 1 when targets that nobody set cost more than the limit."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--skip-build", action="store_true", help="the programs are built already")
    options = parser.parse_args()
    if shutil.which("valgrind") is None:
        raise SystemExit("valgrind is missing: apt-get install valgrind")
    folder = Path(os.environ["MBFEAT_BUILD_DIR"])
    if not options.skip_build:
        command = ["cmake", "--build", str(folder), "--target", "targetBenches"]
        subprocess.run(command, check=True, stdout=sys.stderr)
    sampling, images = {}, set()
    for name in ("targetBench", "targetBenchWithout"):
        few, _ = count(folder / "bin" / name, FEW)
        many, image = count(folder / "bin" / name, MANY)
        sampling[name] = many - few
        images.add(image)
    if len(images) != 1:
        raise SystemExit("the two renderers make different images")
    ratio = sampling["targetBench"] / sampling["targetBenchWithout"]
    print("| renderer | instructions of the sampling |", "|---|---|", sep="\n")
    print(f"| with targets, none set | {sampling['targetBench']} |")
    print(f"| compiled without | {sampling['targetBenchWithout']} |")
    print(f"\nratio: {ratio:.5f}; the limit is {LIMIT}")
    return 0 if ratio <= LIMIT else 1


if __name__ == "__main__":
    sys.exit(main())

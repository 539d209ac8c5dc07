"""The set-up steps, in order. Each knows cheaply whether it is done, and leaves nothing half done.

A step that finished leaves a stamp: a key made from all that its result depends on. What a step
makes is built beside its place and renamed, so a killed run leaves the last good state.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from mbfeat.devtools import usd_runtime
from mbfeat.devtools.console import Console, SetupError, require_disk, run_logged
from mbfeat.devtools.layout import PRESET, Layout, digest, read_stamp, write_whole

SOURCE_FOLDERS = ("hdmbfeat", "plugin", "python/bindings", "tests/cpp", "schemas")
DPKG_INFO = Path("/var/lib/dpkg/info")


class Step:
    """One set-up step: `title` for the user, `name` for stamps and logs."""

    name = ""
    title = ""

    def __init__(self, layout: Layout, console: Console, keep_open: tuple[int, ...] = ()) -> None:
        self.layout = layout
        self.console = console
        self.keep_open = keep_open

    def key(self) -> str:
        """What the result depends on, as a hash; cheap."""
        raise NotImplementedError

    def present(self) -> bool:
        """Whether the result is still there, whatever the stamp says; cheap."""
        return True

    def make(self) -> None:
        """Does the work; may be repeated after being killed at any point."""
        raise NotImplementedError

    def is_done(self) -> bool:
        return read_stamp(self.layout.stamp(self.name)) == self.key() and self.present()

    def run(self) -> None:
        key = self.key()
        self.layout.stamp(self.name).unlink(missing_ok=True)
        self.make()
        write_whole(self.layout.stamp(self.name), key)

    def call(self, command: Sequence[str | Path], failure: str, **environment: str) -> None:
        """Runs a logged command in a clean Python environment."""
        clean = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
        clean.update(PIP_DISABLE_PIP_VERSION_CHECK="1", PIP_NO_INPUT="1", LC_ALL="C.UTF-8")
        clean.update(environment)
        run_logged(
            command,
            console=self.console,
            log=self.layout.log(self.name),
            failure=failure,
            environment=clean,
            keep_open=self.keep_open,
        )


class SystemPackages(Step):
    """Debian packages, installed with apt-get where the user may."""

    name = "system"
    title = "system packages"
    command = ""

    def packages(self) -> list[str]:
        listed = (self.layout.devtools / "system-packages.txt").read_text(encoding="utf-8")
        rows = [line.split() for line in listed.splitlines() if line and line[0] != "#"]
        return [
            package
            for package, *users in rows
            if (self.command in users if self.command else not users)
        ]

    def key(self) -> str:
        return digest(*self.packages())

    def present(self) -> bool:
        if not DPKG_INFO.is_dir():
            return True
        return all(
            (DPKG_INFO / f"{package}.list").exists()
            or (DPKG_INFO / f"{package}:amd64.list").exists()
            for package in self.packages()
        )

    def make(self) -> None:
        packages = self.packages()
        if not DPKG_INFO.is_dir() or not shutil.which("apt-get"):
            self.console.update(f"not a Debian system; make sure it has {' '.join(packages)}")
            return
        missing = self._missing(packages)
        if not missing:
            return
        if os.geteuid() == 0:
            prefix: list[str | Path] = ["env"]
        elif shutil.which("sudo") and _succeeds(["sudo", "-n", "true"]):
            prefix = ["sudo", "-n", "env"]
        else:
            raise SetupError(
                "system packages are missing and only root may install them; run: "
                f"sudo apt-get install --no-install-recommends {' '.join(missing)}"
            )
        prefix += ["DEBIAN_FRONTEND=noninteractive"]
        wait = "DPkg::Lock::Timeout=300"
        failure = "the system packages could not be installed"
        # Finishes what an earlier, killed installation left half configured.
        self.call([*prefix, "dpkg", "--configure", "-a"], failure)
        self.call([*prefix, "apt-get", "-o", wait, "update"], "the package lists could not be read")
        install = ["apt-get", "-o", wait, "install", "-y", "--no-install-recommends", *missing]
        self.call([*prefix, *install], failure)
        left = self._missing(packages)
        if left:
            log = self.layout.log(self.name)
            raise SetupError(f"apt-get did not install {' '.join(left)} (see {log}).")

    @staticmethod
    def _missing(packages: list[str]) -> list[str]:
        query = ["dpkg-query", "-W", "-f", "${Package} ${db:Status-Status}\n", *packages]
        answer = subprocess.run(query, capture_output=True, text=True, check=False).stdout
        installed = {line.split()[0] for line in answer.splitlines() if line.endswith(" installed")}
        return [package for package in packages if package not in installed]


class LintSystemPackages(SystemPackages):
    """The Debian packages that only ./run lint needs."""

    name = "system-lint"
    title = "system packages for lint"
    command = "lint"


class VirtualEnvironment(Step):
    """.mbfeat/venv with the pinned Python packages."""

    name = "venv"
    title = "Python packages"

    @property
    def requirements(self) -> Path:
        return self.layout.devtools / "requirements.txt"

    @property
    def place(self) -> Path:
        """Where the environment is found: a link into `store`."""
        return self.layout.venv

    @property
    def store(self) -> Path:
        return self.layout.made / "venvs"

    def key(self) -> str:
        # A venv holds absolute paths, so its own place counts.
        return digest(base_python(), str(self.place), self.requirements.read_bytes())

    def present(self) -> bool:
        return (self.place / "bin" / "python").exists()

    def make(self) -> None:
        self.make_environment(1000, check=True)
        for command, module in (("mbfeat", "mbfeat.cli"), ("usdrecord", "mbfeat.usdrecord")):
            script = f'#!/bin/sh\nexec "{self.layout.venv_python}" -P -m {module} "$@"\n'
            write_whole(self.layout.bin / command, script, 0o755)

    def make_environment(self, megabytes: int, *, check: bool) -> None:
        """Makes the environment and its link; `check` that its packages ask for no others."""
        require_disk(self.layout.made, megabytes, f"the {self.title}")
        # Made anew each time, in a folder of its own: repairing what a killed pip left behind is
        # not reliable, and a helper process that outlived a killed ./run may still write there.
        folder = self.store / f"{os.getpid()}-{time.time_ns()}"
        self._remove_others()
        self.fill(folder)
        if check:
            self.pip(["check"], "the pinned Python packages do not fit together", folder)
        link = folder.with_name("link.partial")
        link.unlink(missing_ok=True)
        link.symlink_to(folder.relative_to(self.layout.made))
        if self.place.is_dir() and not self.place.is_symlink():
            shutil.rmtree(self.place)
        os.replace(link, self.place)
        self._remove_others()

    def fill(self, folder: Path) -> None:
        """Makes an environment with the required packages in `folder`."""
        failure = f"no virtual environment could be made with {base_python()}"
        self.call([base_python(), "-m", "venv", folder], failure)
        lines = self.requirements.read_text(encoding="utf-8").splitlines()
        pip = [line for line in lines if line.startswith("pip==")]
        failure = "the pinned Python packages could not be installed"
        self.pip(["install", "--progress-bar", "off", *pip], failure, folder)
        raw = ["--progress-bar", "raw"]
        self.pip(["install", "--no-deps", *raw, "-r", self.requirements], failure, folder)

    def _remove_others(self) -> None:
        """Removes the environments that the link does not point to."""
        current = self.place.resolve()
        for folder in self.store.glob("*"):
            if folder.resolve() != current:
                shutil.rmtree(folder, ignore_errors=True)

    def pip(self, arguments: Sequence[str | Path], failure: str, folder: Path) -> None:
        """Runs the pip of the environment in `folder`."""
        python = folder / "bin" / "python"
        self.call([python, "-m", "pip", "--retries", "2", *arguments], failure)


class LintPackages(VirtualEnvironment):
    """The Python packages that only ./run lint needs, added to the same environment."""

    name = "venv-lint"
    title = "Python packages for lint"

    @property
    def requirements(self) -> Path:
        return self.layout.devtools / "requirements-lint.txt"

    def key(self) -> str:
        return digest(read_stamp(self.layout.stamp("venv")), self.requirements.read_bytes())

    def present(self) -> bool:
        return (self.layout.venv / "bin" / "ruff").exists()

    def make(self) -> None:
        install = ["install", "--no-deps", "--force-reinstall", "-r"]
        failure = "the Python packages for lint could not be installed"
        self.pip([*install, self.requirements], failure, self.layout.venv)


class UsdRuntime(Step):
    """.mbfeat/usd: the OpenUSD runtime and the headers of its base libraries."""

    name = "usd"
    title = f"OpenUSD runtime (from bpy {usd_runtime.BPY_VERSION}, 374 MB)"

    def key(self) -> str:
        code = Path(usd_runtime.__file__).read_bytes()
        return digest(usd_runtime.BPY_VERSION, *usd_runtime.HEADER_PACKAGES, code)

    def present(self) -> bool:
        prefix = self.layout.usd
        return (prefix / "lib" / "libusd_ms.so").exists() and (prefix / "include").exists()

    def make(self) -> None:
        require_disk(self.layout.made, 1500, "the OpenUSD runtime")
        self._remove_partials()
        partial = self.layout.usd.with_name(f"usd.{os.getpid()}.partial")
        runtime = self._runtime_wheel()
        headers = self._downloaded("headers", list(usd_runtime.HEADER_PACKAGES))
        try:
            usd_runtime.unpack_runtime(runtime, partial, self.console.update)
            usd_runtime.unpack_headers(headers, partial)
        except OSError as error:
            raise SetupError(f"the OpenUSD runtime could not be unpacked: {error}.") from error
        old = self.layout.usd.with_name(f"usd.{os.getpid()}.old.partial")
        if self.layout.usd.exists():
            self.layout.usd.rename(old)
        partial.rename(self.layout.usd)
        self._remove_partials()
        shutil.rmtree(self.layout.downloads, ignore_errors=True)

    def _remove_partials(self) -> None:
        for left in self.layout.made.glob("usd.*.partial"):
            shutil.rmtree(left, ignore_errors=True)

    def _runtime_wheel(self) -> Path:
        local = os.environ.get("MBFEAT_BPY_WHEEL", "")
        if not local:
            return self._downloaded("runtime", [f"bpy=={usd_runtime.BPY_VERSION}"])[0]
        if not Path(local).is_file():
            raise SetupError(
                f"MBFEAT_BPY_WHEEL={local} is not a file; name the wheel "
                f"bpy=={usd_runtime.BPY_VERSION}, or unset it to download."
            )
        return Path(local)

    def _downloaded(self, group: str, packages: list[str]) -> list[Path]:
        """The wheels of these packages; a finished download is kept until the prefix is made."""
        folder = self.layout.downloads / group
        if not folder.is_dir():
            partial = folder.with_name(f"{group}.partial")
            shutil.rmtree(partial, ignore_errors=True)
            partial.mkdir(parents=True)
            pip: list[str | Path] = [self.layout.venv_python, "-m", "pip", "--retries", "2"]
            pip += ["download", "--no-deps", "--no-cache-dir", "--only-binary", ":all:"]
            pip += ["--progress-bar", "raw", "-d", partial, *packages]
            self.call(pip, f"{packages[0]} could not be downloaded")
            partial.rename(folder)
        return sorted(folder.glob("*.whl"))


class Build(Step):
    """The CMake build of the release preset."""

    name = "build"
    title = "build"

    def key(self) -> str:
        """Changes with every source file's name, size or time, and with what is built against."""
        rows = []
        for path, status in self._sources():
            rows.append(f"{path} {status.st_size} {status.st_mtime_ns}")
        script = (self.layout.devtools / "export_ocio.py").read_bytes()
        stamps = [read_stamp(self.layout.stamp(name)) for name in ("venv", "usd")]
        return digest(str(self.layout.root), script, *stamps, *sorted(rows))

    def _sources(self) -> Iterator[tuple[str, os.stat_result]]:
        root = str(self.layout.root)
        folders = [f"{root}/{folder}" for folder in SOURCE_FOLDERS]
        single = ("CMakeLists.txt", "CMakePresets.json", "python/CMakeLists.txt")
        for name in single:
            yield name, os.stat(f"{root}/{name}")
        while folders:
            folder = folders.pop()
            if not os.path.isdir(folder):
                continue
            with os.scandir(folder) as entries:
                for entry in entries:
                    if entry.is_dir(follow_symlinks=False):
                        if entry.name != "__pycache__":
                            folders.append(entry.path)
                    elif entry.name.endswith((".cpp", ".h", ".txt", ".cmake", ".json", ".usda")):
                        yield entry.path, entry.stat()

    def present(self) -> bool:
        return (self.layout.build / "build.ninja").exists()

    def make(self) -> None:
        require_disk(self.layout.made, 500, "the build")
        cache = self.layout.build / "CMakeCache.txt"
        if cache.exists() and not self._configured_here(cache):
            shutil.rmtree(self.layout.build)
        os.chdir(self.layout.root)
        self.call(["cmake", "--preset", PRESET], "CMake could not configure the build")
        jobs = str(len(os.sched_getaffinity(0)))
        self.call(["cmake", "--build", self.layout.build, "-j", jobs], "the build failed")

    def _configured_here(self, cache: Path) -> bool:
        home = re.search(r"^CMAKE_HOME_DIRECTORY:INTERNAL=(.*)$", cache.read_text(), re.MULTILINE)
        return home is not None and Path(home.group(1)) == self.layout.root


def base_python() -> str:
    """The interpreter beneath this one's virtual environment, if it runs in one."""
    return os.path.realpath(getattr(sys, "_base_executable", sys.executable))


def _succeeds(command: list[str]) -> bool:
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


ALWAYS = (SystemPackages, VirtualEnvironment, UsdRuntime, Build)
FOR_LINT = (LintSystemPackages, LintPackages)

"""Reads what the compiler made of class declarations from a file's DWARF debug information.

GNU readelf prints the entries; this module turns them into classes with sizes, offsets, virtual
slots and mangled names. The debug information lists every declared member function, also pure and
never defined ones, which no symbol table does. Understands DWARF 4 of one compilation unit.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

_ENTRY = re.compile(r"^ <(\d+)><([0-9a-f]+)>: Abbrev Number: \d+ \(DW_TAG_(\w+)\)")
_ATTRIBUTE = re.compile(r"^ {3,}<[0-9a-f]+>\s+DW_AT_(\w+)\s*: (.*)$")
_INDIRECT = re.compile(r"^\(indirect (?:line )?string, offset: 0x[0-9a-f]+\): ")
_DIRECTORY = re.compile(r"^  (\d+)\t(.*)$")
_FILE = re.compile(r"^  (\d+)\t(\d+)\t\d+\t\d+\t(.*)$")
_ACCESS = {"1": "public", "2": "protected", "3": "private"}


@dataclass
class Member:
    """A data member, in bytes from the start of the object; `offset` of a bit field is its byte."""

    name: str
    offset: int
    size: int | None


@dataclass
class Method:
    """A member function. `returns` are the ways to write its type: by typedef, and resolved."""

    name: str
    mangled: str
    access: str
    returns: set[str]
    static: bool = False
    slot: int | None = None
    virtual: bool = False
    deleted: bool = False
    defaulted: bool = False


@dataclass
class Class:
    """One class; nested names are written Outer::Inner, namespaces are left out."""

    name: str
    size: int
    file: str
    bases: list[tuple[str, int]] = field(default_factory=list)
    members: list[Member] = field(default_factory=list)
    methods: list[Method] = field(default_factory=list)

    @property
    def polymorphic(self) -> bool:
        """Whether the class declares or overrides a virtual function."""
        return any(method.virtual for method in self.methods)


@dataclass
class Declarations:
    """Classes and enumerations (values by enumerator) that one folder's headers declare."""

    classes: dict[str, Class] = field(default_factory=dict)
    enums: dict[str, dict[str, int]] = field(default_factory=dict)


@dataclass
class _Entry:
    tag: str
    parent: _Entry | None
    attributes: dict[str, str] = field(default_factory=dict)
    children: list[_Entry] = field(default_factory=list)

    def number(self, name: str) -> int:
        return int(self.attributes[name].split()[0], 0)


def read(path: Path, folder: Path) -> Declarations:
    """The classes and enumerations that headers under `folder` declare in the object file `path`.

    Raises subprocess.CalledProcessError if readelf fails.
    """
    files = _files(path)
    entries = _entries(path)
    found = Declarations()
    for entry in entries.values():
        if entry.tag not in ("class_type", "structure_type", "enumeration_type"):
            continue
        if "declaration" in entry.attributes or "name" not in entry.attributes:
            continue
        file = files.get(entry.number("decl_file") if "decl_file" in entry.attributes else 0, "")
        if not Path(file).is_relative_to(folder):
            continue
        name = _qualified(entry)
        if entry.tag == "enumeration_type":
            found.enums[name] = {
                child.attributes["name"]: child.number("const_value")
                for child in entry.children
                if child.tag == "enumerator"
            }
        else:
            found.classes[name] = _class(name, entry, entries, file)
    return found


def _class(name: str, entry: _Entry, entries: dict[int, _Entry], file: str) -> Class:
    result = Class(name, entry.number("byte_size"), file)
    for child in entry.children:
        if child.tag == "inheritance":
            base = _target(child, entries)
            assert base is not None
            result.bases.append((_qualified(base), child.number("data_member_location")))
        elif child.tag == "member" and "external" not in child.attributes:
            text = child.attributes["name"]
            if text.startswith("_vptr"):
                continue
            if "data_member_location" in child.attributes:
                offset = child.number("data_member_location")
            else:
                offset = child.number("data_bit_offset") // 8
            result.members.append(Member(text, offset, _size(_target(child, entries), entries)))
        elif child.tag == "subprogram" and "artificial" in child.attributes:
            continue  # implicit: it follows from the members
        elif child.tag == "subprogram" and "linkage_name" in child.attributes:
            result.methods.append(_method(child, entries))
    return result


def _method(entry: _Entry, entries: dict[int, _Entry]) -> Method:
    attributes = entry.attributes
    slot = re.search(r"DW_OP_constu: (\d+)", attributes.get("vtable_elem_location", ""))
    parent = entry.parent
    default = "3" if parent is not None and parent.tag == "class_type" else "1"
    return Method(
        name=attributes["name"],
        mangled=attributes["linkage_name"],
        access=_ACCESS[attributes.get("accessibility", default).split()[0]],
        returns=_spellings(entry, entries),
        static="object_pointer" not in attributes,
        slot=int(slot.group(1)) if slot else None,
        virtual="virtuality" in attributes,
        deleted="deleted" in attributes,
        defaulted="defaulted" in attributes,
    )


def _spellings(entry: _Entry, entries: dict[int, _Entry]) -> set[str]:
    """The type of an entry, written with the typedef it uses and with what that stands for."""
    target = _target(entry, entries)
    if target is None:
        return {"void"}
    suffix = {
        "pointer_type": "*",
        "reference_type": "&",
        "rvalue_reference_type": "&&",
        "const_type": " const",
    }.get(target.tag)
    if suffix is not None:
        return {inner + suffix for inner in _spellings(target, entries)}
    names = {_qualified(target)}
    if target.tag == "typedef":
        names |= _spellings(target, entries)
    return names


def _size(entry: _Entry | None, entries: dict[int, _Entry]) -> int | None:
    """Bytes of a type, or None where the debug information does not say."""
    while entry is not None:
        if "byte_size" in entry.attributes:
            return entry.number("byte_size")
        if entry.tag == "array_type":
            element = _size(_target(entry, entries), entries)
            bounds = [child for child in entry.children if "upper_bound" in child.attributes]
            if element is None or len(bounds) != 1:
                return None
            return element * (bounds[0].number("upper_bound") + 1)
        entry = _target(entry, entries)
    return None


def _target(entry: _Entry, entries: dict[int, _Entry]) -> _Entry | None:
    reference = entry.attributes.get("type")
    return entries[int(reference.strip("<>"), 16)] if reference else None


def _qualified(entry: _Entry) -> str:
    parts = [entry.attributes.get("name", "?")]
    parent = entry.parent
    while parent is not None and parent.tag in ("class_type", "structure_type"):
        parts.append(parent.attributes.get("name", "?"))
        parent = parent.parent
    return "::".join(reversed(parts))


def _entries(path: Path) -> dict[int, _Entry]:
    """All debug information entries by offset."""
    entries: dict[int, _Entry] = {}
    open_entries: list[_Entry] = []
    current: _Entry | None = None
    for line in _readelf("info", path):
        if match := _ENTRY.match(line):
            depth = int(match.group(1))
            del open_entries[depth:]
            current = _Entry(match.group(3), open_entries[-1] if open_entries else None)
            if current.parent is not None:
                current.parent.children.append(current)
            open_entries.append(current)
            entries[int(match.group(2), 16)] = current
        elif current is not None and (match := _ATTRIBUTE.match(line)):
            text = _INDIRECT.sub("", match.group(2)).strip()
            current.attributes[match.group(1)] = text
    return entries


def _files(path: Path) -> dict[int, str]:
    """Source files by their number in the line table."""
    directories: dict[str, str] = {}
    files: dict[int, str] = {}
    for line in _readelf("rawline", path):
        if match := _FILE.match(line):
            number, directory, name = match.groups()
            files[int(number)] = str(Path(directories.get(directory, "")) / name)
        elif match := _DIRECTORY.match(line):
            directories[match.group(1)] = match.group(2)
    return files


def _readelf(section: str, path: Path) -> Iterator[str]:
    result = subprocess.run(
        ["readelf", f"--debug-dump={section}", str(path)],
        check=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        errors="replace",
        env={"LC_ALL": "C", "PATH": "/usr/bin:/bin"},
    )
    yield from result.stdout.splitlines()

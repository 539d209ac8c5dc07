"""Compares the Hydra declarations in hdmbfeat/hydra with the OpenUSD library they describe.

Three sources are held against each other:

- what the compiler made of the declarations: sizes, offsets, slots, mangled names (debug
  information of a probe), and the virtual function tables of subclasses of every class;
- a table of facts about the library's classes, for what a library file does not contain: sizes,
  offsets, access, return types, names of pure virtual functions;
- the library: its exported functions and its virtual function tables.

`findings` returns one sentence for each difference, and nothing when all agree.
"""

from __future__ import annotations

import json
import re
import subprocess
import sysconfig
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mbfeat.devtools.class_layout import Class, Declarations, Method, read
from mbfeat.devtools.elf_symbols import PURE_VIRTUAL, ElfFile

NAMESPACE = "pxrBlender_v25_08__pxrReserved__"
# Members of this name stand for bytes that only the library uses.
OPAQUE = "_opaque"
_PREFIX = f"{len(NAMESPACE)}{NAMESPACE}"
_FUNCTION = re.compile(r"([\w:]+|operator[^\w(]+)\((.*)\)")
# A declaration up to its semicolon: name, then parameters with at most one level of parentheses.
_DECLARATION = re.compile(r"\b([A-Za-z]\w*|operator[^\w(]+)\s*\([^()]*(?:\([^()]*\))?[^()]*\)\s*$")


@dataclass(frozen=True)
class Probe:
    """A compiled probe: its declarations and its object file."""

    declarations: Declarations
    object_file: ElfFile


class CompileError(RuntimeError):
    """The compiler refused the probe; the text is its output."""


def load_facts(path: Path) -> dict[str, Any]:
    """The table of facts."""
    facts: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return facts


def compile_flags(hydra: Path, usd_root: Path) -> list[str]:
    """How sources that include the declarations are compiled; see plugin/OpenUSD.cmake."""
    return [
        "-std=c++17",
        "-fPIC",
        "-DNDEBUG",
        "-Wno-cpp",
        "-DPXR_PYTHON_SUPPORT_ENABLED",
        f"-DpxrInternal_v0_25_8__pxrReserved__={NAMESPACE}",
        *(f"-DMFB_{kind}=hdMBFeat" for kind in ("PACKAGE_NAME", "ALT_PACKAGE_NAME")),
        "-DMFB_PACKAGE_MODULE=HdMBFeat",
        f"-I{hydra}",
        f"-isystem{usd_root / 'include'}",
        f"-isystem{sysconfig.get_paths()['include']}",
    ]


def compile_probe(hydra: Path, usd_root: Path, facts: dict[str, Any], scratch: Path) -> Probe:
    """Compiles a probe of all declarations under `hydra`, in `scratch`.

    The probe includes every header, derives from every polymorphic class, uses every free function
    of the facts, and asserts alignment and how objects are passed. -fkeep-inline-functions keeps
    what the declarations define themselves visible as symbols. Raises CompileError.
    """
    source = scratch / "probe.cpp"
    source.write_text(probe_source(hydra, facts), encoding="utf-8")
    target = scratch / "probe.o"
    result = subprocess.run(
        [
            "g++",
            *compile_flags(hydra, usd_root),
            "-fno-access-control",
            "-fkeep-inline-functions",
            "-gdwarf-4",
            "-fno-eliminate-unused-debug-types",
            "-femit-class-debug-always",
            "-c",
            str(source),
            "-o",
            str(target),
        ],
        check=False,
        capture_output=True,
        text=True,
    )
    if result.returncode != 0:
        raise CompileError(result.stderr)
    return Probe(read(target, hydra), ElfFile(target))


def probe_source(hydra: Path, facts: dict[str, Any]) -> str:
    """The probe's text."""
    headers = sorted(path.relative_to(hydra) for path in hydra.glob("pxr/imaging/**/*.h"))
    lines = [f'#include "{header}"' for header in headers]
    lines += ["#include <type_traits>", "PXR_NAMESPACE_OPEN_SCOPE"]
    for name, (size, align) in facts["base_types"].items():
        condition = f"sizeof({name}) == {size} && alignof({name}) == {align}"
        lines.append(f'static_assert({condition}, "{name}");')
    for name, fact in facts["classes"].items():
        if fact["align"] is not None:
            lines.append(f'static_assert(alignof({name}) == {fact["align"]}, "{name}");')
        passed = "" if name in facts["passed_in_registers"] else "!"
        if name in facts["passed_in_registers"] or fact["virtual"]:
            lines.append(f'static_assert({passed}std::is_trivially_copyable_v<{name}>, "{name}");')
        if fact["virtual"]:
            # The function that is defined makes the compiler emit the table, and shows where a
            # subclass's own virtual functions begin.
            probe = _probe_name(name)
            lines.append(f"struct {probe} : {name} {{ virtual void own(); }};")
            lines.append(f"void {probe}::own() {{}}")
    for index, function in enumerate(facts["functions"]):
        name, arguments = _name_and_arguments(function)
        signature = f"{function['returns']} (*)({arguments})"
        lines.append(f"auto* volatile function{index} = static_cast<{signature}>(&{name});")
    lines.append("PXR_NAMESPACE_CLOSE_SCOPE")
    return "\n".join(lines) + "\n"


def findings(probe: Probe, facts: dict[str, Any], library: ElfFile) -> list[str]:
    """Every difference between declarations, facts and library, as a sentence each."""
    exported = library.defined()
    emitted = probe.object_file.defined()
    classes = probe.declarations.classes
    result = [
        f"{name}: in the facts, but not declared" for name in facts["classes"].keys() - classes
    ]
    for name, declared in sorted(classes.items()):
        fact = facts["classes"].get(name)
        if fact is None:
            result.append(f"{name}: declared, but not in the facts (tests/python/hydra_facts.json)")
            continue
        result += _compare_layout(declared, fact)
        result += _compare_methods(declared, fact, exported, emitted)
    result += _compare_enums(probe.declarations.enums, facts["enums"])
    result += _compare_tables(probe, facts, library)
    for function in facts["functions"]:
        if function["mangled"] not in probe.object_file.undefined():
            result.append(f"{function['demangled']}: not declared with this signature")
    result += missing_symbols(probe.object_file, library)
    return result + foreign_tables(probe.object_file, facts, library)


def missing_symbols(user: ElfFile, library: ElfFile) -> list[str]:
    """OpenUSD symbols that a file needs and the library lacks: the loader would tell too late."""
    needed = {name for name in user.undefined() if _PREFIX in name}
    return [
        f"{name}: needed, but not in the library" for name in sorted(needed - library.defined())
    ]


def foreign_tables(user: ElfFile, facts: dict[str, Any], library: ElfFile) -> list[str]:
    """Tables and type informations of library classes that a file defines a second time."""
    mine, theirs = user.defined(), library.defined()
    result = []
    for name, fact in facts["classes"].items():
        if not fact["virtual"] or name in facts["inline_classes"]:
            continue  # plain classes' type information is emitted wherever it is used
        for kind in ("_ZTV", "_ZTI"):
            symbol = kind + _mangle(name)
            if symbol in mine and symbol in theirs:
                result.append(f"{name}: {symbol} is emitted again; a library function is defined")
    return result


def declared_functions(hydra: Path) -> set[str]:
    """Names of the free functions that the headers declare at namespace scope."""
    names: set[str] = set()
    for header in hydra.glob("pxr/imaging/**/*.h"):
        text = re.sub(r"//[^\n]*", "", header.read_text(encoding="utf-8"))
        text = re.sub(r"^\s*#(?:[^\n]*\\\n)*[^\n]*", "", text, flags=re.MULTILINE)
        scopes: list[str] = []
        statement = ""
        for character in text:
            if character == "{":
                namespace = re.search(r"\bnamespace (\w+)\s*$", statement)
                scopes.append(namespace.group(1) + "::" if namespace else "")
                statement = ""
            elif character == "}":
                scopes.pop()
                statement = ""
            elif character == ";":
                if all(scopes) and not re.match(r"\s*(?:using|static_assert|enum)\b", statement):
                    found = _DECLARATION.search(statement)
                    if found and not found.group(1).isupper():
                        names.add("".join(scopes) + found.group(1))
                statement = ""
            else:
                statement += character
    return names


def _compare_layout(declared: Class, fact: dict[str, Any]) -> Iterator[str]:
    name = declared.name
    if fact["size"] is not None and declared.size != fact["size"]:
        yield f"{name}: {declared.size} bytes, the library's has {fact['size']}"
    bases = [[base, offset] for base, offset in declared.bases]
    if bases != fact["bases"]:
        yield f"{name}: bases {bases}, the library's has {fact['bases']}"
    expected = {member: (offset, size) for member, offset, size in fact["members"]}
    hidden: list[range] = []
    for member in declared.members:
        if member.name.startswith(OPAQUE):
            hidden.append(range(member.offset, member.offset + (member.size or 0)))
            continue
        if member.name not in expected:
            yield f"{name}::{member.name}: the library's class has no such member"
            continue
        offset, size = expected.pop(member.name)
        if member.offset != offset:
            yield f"{name}::{member.name}: at {member.offset}, the library's is at {offset}"
        if member.size is not None and size is not None and member.size != size:
            yield f"{name}::{member.name}: {member.size} bytes, the library's has {size}"
    for member_name, (offset, _size) in expected.items():
        if not any(offset in place for place in hidden):
            yield f"{name}::{member_name}: not declared (the library's is at {offset})"


def _compare_methods(
    declared: Class, fact: dict[str, Any], exported: set[str], emitted: set[str]
) -> Iterator[str]:
    methods = {method.mangled: method for method in declared.methods}
    for mangled, known in fact["methods"].items():
        if known["slot"] is not None and mangled not in methods and fact["size"] is not None:
            yield f"{declared.name}: virtual function {mangled} is not declared"
    for mangled, method in methods.items():
        where = f"{declared.name}::{method.name} ({mangled})"
        mine = _symbols(mangled) & emitted
        theirs = _symbols(mangled) & exported
        pure = method.virtual and mangled in fact["pure"]
        inline = bool(mine) or method.deleted or method.defaulted
        if not inline and not pure and not theirs:
            yield f"{where}: neither defined inline nor exported by the library"
        if mine and theirs and method.virtual:
            yield f"{where}: defined here, but the library defines it"
        known = fact["methods"].get(mangled)
        if known is None:
            if method.virtual:
                yield f"{where}: the library's class has no such virtual function"
            elif not inline:
                yield f"{where}: not in the facts (tests/python/hydra_facts.json)"
            continue
        yield from _compare_method(where, method, known)


def _compare_method(where: str, method: Method, known: dict[str, Any]) -> Iterator[str]:
    if method.slot != known["slot"] and not method.name.startswith("~"):
        yield f"{where}: slot {method.slot}, the library's has {known['slot']}"
    if not method.deleted and method.access != known["access"]:
        yield f"{where}: {method.access}, the library's is {known['access']}"
    if method.static != known["static"]:
        yield f"{where}: static in one, not in the other"
    returns = {_normalised(text) for text in method.returns}
    if known["returns"] is not None and _normalised(known["returns"]) not in returns:
        yield f"{where}: returns {sorted(returns)}, the library's {known['returns']}"


def _compare_enums(
    declared: dict[str, dict[str, int]], known: dict[str, dict[str, int]]
) -> Iterator[str]:
    for name, values in declared.items():
        if name not in known:
            yield f"{name}: enumeration is not in the facts"
            continue
        for enumerator in sorted(values.keys() | known[name].keys()):
            mine, theirs = values.get(enumerator), known[name].get(enumerator)
            if mine is None or theirs is None or (mine - theirs) % 2**32:
                yield f"{name}::{enumerator}: {mine}, the library's is {theirs}"


def _compare_tables(probe: Probe, facts: dict[str, Any], library: ElfFile) -> Iterator[str]:
    names = [name for name, fact in facts["classes"].items() if fact["virtual"]]
    theirs = library.virtual_tables(_mangle(name) for name in names)
    mine = probe.object_file.virtual_tables(_mangle(_probe_name(name)) for name in names)
    for name in names:
        table = mine.get(_mangle(_probe_name(name)))
        if table is None:
            yield f"{name}: the probe emitted no virtual function table"
            continue
        expected = theirs.get(_mangle(name))
        if expected is None:
            if name not in facts["without_table"]:
                yield f"{name}: the library has no virtual function table"
            continue
        if len(table) != len(expected) + 1:
            yield f"{name}: {len(table) - 1} virtual slots, the library's has {len(expected)}"
        for slot, (found, wanted) in enumerate(zip(table, expected, strict=False)):
            if not _same_function(found, wanted, _mangle(_probe_name(name))):
                yield f"{name}: slot {slot} is {sorted(found)}, the library's {sorted(wanted)}"


def _same_function(found: frozenset[str], wanted: frozenset[str], probe: str) -> bool:
    """Whether a slot of the probe's table holds what the library's holds.

    The probe's destructors are its own; the library's are null where its class is abstract.
    """
    destructors = [f"_ZN{probe[1:-1]}D{kind}Ev" for kind in (1, 0)]
    for destructor in destructors:
        if destructor in found:
            kind = destructor[-4:]
            return not wanted or any(name.endswith(kind) for name in wanted)
    if not wanted or found == {PURE_VIRTUAL}:
        return found == wanted
    return bool(found & wanted)


def _symbols(mangled: str) -> set[str]:
    """Symbols of a declared function: constructors and destructors are declared as C4 and D4."""
    variants = {mangled}
    for generic, kinds in (("C4E", "12"), ("D4E", "012")):
        if generic in mangled:
            variants |= {mangled.replace(generic, f"{generic[0]}{kind}E") for kind in kinds}
    return variants


def _mangle(name: str) -> str:
    parts: Iterable[str] = (NAMESPACE, *name.split("::"))
    return "N" + "".join(f"{len(part)}{part}" for part in parts) + "E"


def _name_and_arguments(function: dict[str, Any]) -> tuple[str, str]:
    match = _FUNCTION.fullmatch(function["demangled"])
    assert match is not None
    return match.group(1), match.group(2)


def _probe_name(name: str) -> str:
    return name.replace("::", "_") + "Probe"


def _normalised(text: str) -> str:
    """A type's text without namespaces, default template arguments and spaces."""
    text = re.sub(rf"\b(?:std|__cxx11|{NAMESPACE})::", "", text)
    for _ in range(4):
        text = re.sub(r", (?:allocator|less|equal_to|char_traits)<[^<>]*>", "", text)
    return text.replace(" ", "")

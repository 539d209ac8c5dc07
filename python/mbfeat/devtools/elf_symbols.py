"""Reads symbols and virtual function tables of x86-64 ELF files (shared objects and .o files).

Only what a check of binary interfaces needs, with the standard library alone. Names are mangled.
"""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

PURE_VIRTUAL = "__cxa_pure_virtual"

_SECTION_SYMTAB, _SECTION_RELA, _SECTION_DYNSYM = 2, 4, 11
_R_X86_64_64, _R_X86_64_RELATIVE = 1, 8
_WORD = 8
# A table starts with the offset to the top of the object and the address of the type information.
_TABLE_HEADER_WORDS = 2


class ElfError(ValueError):
    """The file is not an ELF file of the expected kind, or lacks what was asked for."""


@dataclass(frozen=True)
class Symbol:
    """One entry of a symbol table; `section` is 0 for a symbol that the file does not define."""

    name: str
    value: int
    size: int
    section: int


@dataclass(frozen=True)
class _Section:
    kind: int
    offset: int
    size: int
    link: int
    info: int


class ElfFile:
    """An ELF file, mapped while the object lives."""

    def __init__(self, path: Path) -> None:
        self.path = path
        with path.open("rb") as file:
            self._data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        if self._data[:6] != b"\x7fELF\x02\x01":
            raise ElfError(f"{path}: not a 64-bit little-endian ELF file")
        (self._type,) = struct.unpack_from("<H", self._data, 16)
        self._sections = list(self._read_sections())
        self._tables = {
            index: self._read_symbols(section)
            for index, section in enumerate(self._sections)
            if section.kind in (_SECTION_SYMTAB, _SECTION_DYNSYM)
        }
        self._symbols = [symbol for table in self._tables.values() for symbol in table]

    def defined(self) -> set[str]:
        """Names that the file defines."""
        return {symbol.name for symbol in self._symbols if symbol.section and symbol.name}

    def undefined(self) -> set[str]:
        """Names that the file uses and another must define."""
        return {symbol.name for symbol in self._symbols if not symbol.section and symbol.name}

    def virtual_tables(self, classes: Iterable[str]) -> dict[str, list[frozenset[str]]]:
        """The virtual functions of each class (mangled name without prefix), by slot.

        A slot holds every name of the function at its address, several where identical functions
        were folded; none for a null slot (destructors of an abstract class); `PURE_VIRTUAL` for a
        pure function. Classes whose table the file does not define are left out. Only primary
        tables are understood, which is all that single inheritance needs.
        """
        wanted = {f"_ZTV{name}": name for name in classes}
        found = {
            wanted[symbol.name]: symbol
            for symbol in self._symbols
            if symbol.section and symbol.name in wanted
        }
        targets = self._relocated_words(found.values())
        tables = {}
        for name, symbol in found.items():
            words = range(symbol.value, symbol.value + symbol.size, _WORD)
            slots = [targets.get((symbol.section, word), frozenset()) for word in words]
            tables[name] = slots[_TABLE_HEADER_WORDS:]
        return tables

    def _relocated_words(self, symbols: Iterable[Symbol]) -> dict[tuple[int, int], frozenset[str]]:
        """Names at the relocated words inside the symbols, by section and address (.o: offset)."""
        words = {
            (symbol.section, word)
            for symbol in symbols
            for word in range(symbol.value, symbol.value + symbol.size, _WORD)
        }
        relocatable = self._type == 1
        section_of = {word: section for section, word in words}
        names_at: dict[int, set[str]] = {}
        if not relocatable:
            for symbol in self._symbols:
                if symbol.section and symbol.name:
                    names_at.setdefault(symbol.value, set()).add(symbol.name)
        targets: dict[tuple[int, int], frozenset[str]] = {}
        for section, table, offset, kind, index, addend in self._relocations():
            place = (section if relocatable else section_of.get(offset, -1), offset)
            if place not in words:
                continue
            if kind == _R_X86_64_64:
                targets[place] = frozenset({table[index].name})
            elif kind == _R_X86_64_RELATIVE:
                targets[place] = frozenset(names_at.get(addend, ()))
        return targets

    def _relocations(self) -> Iterator[tuple[int, list[Symbol], int, int, int, int]]:
        """(section that is relocated, symbol table, offset, type, symbol index, addend)."""
        for section in self._sections:
            if section.kind != _SECTION_RELA:
                continue
            table = self._tables.get(section.link, [])
            body = self._data[section.offset : section.offset + section.size]
            for offset, info, addend in struct.iter_unpack("<QQq", body):
                yield section.info, table, offset, info & 0xFFFFFFFF, info >> 32, addend

    def _read_sections(self) -> Iterator[_Section]:
        (start,) = struct.unpack_from("<Q", self._data, 40)
        entry_size, count = struct.unpack_from("<HH", self._data, 58)
        if count == 0:  # more sections than 16 bits count: the first one's size says how many
            (count,) = struct.unpack_from("<Q", self._data, start + 32)
        for index in range(count):
            fields = struct.unpack_from("<IIQQQQIIQQ", self._data, start + index * entry_size)
            _name, kind, _flags, _address, offset, size, link, info, _align, _entry = fields
            yield _Section(kind, offset, size, link, info)

    def _read_symbols(self, section: _Section) -> list[Symbol]:
        strings = self._sections[section.link]
        names = self._data[strings.offset : strings.offset + strings.size]
        body = self._data[section.offset : section.offset + section.size]
        symbols = []
        for name, _info, _other, index, value, size in struct.iter_unpack("<IBBHQQ", body):
            text = names[name : names.index(b"\0", name)].decode(errors="replace")
            symbols.append(Symbol(text, value, size, index))
        return symbols

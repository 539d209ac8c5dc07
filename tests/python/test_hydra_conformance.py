"""The Hydra declarations in hdmbfeat/hydra describe the classes of the OpenUSD library exactly.

A wrong slot, offset or size compiles, and then calls another function or writes over memory. The
comparison itself is under test too: a copy of the declarations with known mistakes must be refused.
"""

from __future__ import annotations

import os
import re
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from mbfeat.devtools import hydra_interface
from mbfeat.devtools.elf_symbols import ElfFile
from mbfeat.devtools.hydra_interface import CompileError, Probe

HYDRA = Path("hdmbfeat") / "hydra"


@dataclass(frozen=True)
class Mistake:
    """A change of a declaration, and the finding it must lead to (a regular expression)."""

    header: str
    right: str
    wrong: str
    finding: str


MISTAKES = {
    "overloads of a virtual function swapped": Mistake(
        "hd/sceneIndexPlugin.h",
        r"(    virtual \w+ _AppendSceneIndex\(const HdSceneIndexBaseRefPtr&[^;]*;\n)"
        r"(    virtual \w+ _AppendSceneIndex\(const std::string&[^;]*;\n)",
        r"\2\1",
        r"HdSceneIndexPlugin: slot 2 is .*_AppendSceneIndexERKNSt7__cxx11",
    ),
    "pure virtual functions swapped": Mistake(
        "hd/renderBuffer.h",
        r"(.*GetWidth\(\).*\n)(.*GetHeight\(\).*\n)",
        r"\2\1",
        r"HdRenderBuffer::GetWidth .*: slot 7, the library's has 6",
    ),
    "virtual function missing": Mistake(
        "hd/renderParam.h",
        r".*virtual bool IsValid\(\) const;\n",
        "",
        r"HdRenderParam: 5 virtual slots, the library's has 6",
    ),
    "virtual function too many": Mistake(
        "hd/light.h",
        r"(    ~HdLight\(\) override;\n)",
        r"\1    virtual void Illuminate();\n",
        r"HdLight::Illuminate .*: the library's class has no such virtual function",
    ),
    "members missing, size adjusted": Mistake(
        "hd/camera.h",
        r"    float _exposureTime;\n(?:.*\n){3}    float _linearExposureScale;\n((?:.*\n)*.*)336",
        r"    float _linearExposureScale;\n\g<1>320",
        r"HdCamera: 320 bytes, the library's has 336",
    ),
    "offset wrong, size right": Mistake(
        "hd/renderPassState.h",
        r"_opaqueStyle\[52\]",
        "_opaqueStyle[48]",
        r"HdRenderPassState::_lightingEnabled: at 124, the library's is at 128",
    ),
    "argument type wrong": Mistake(
        "hd/instancer.h",
        r"const HdRprim& rprim",
        "HdRprim& rprim",
        r"HdInstancer::GetInstancerNumLevels .*: neither defined inline nor exported",
    ),
    "return type wrong": Mistake(
        "hd/renderIndex.h",
        r"HdBprim\* GetBprim",
        "HdSprim* GetBprim",
        r"HdRenderIndex::GetBprim .*: returns \['HdSprim\*'\], the library's HdBprim\*",
    ),
    "library's destructor defined": Mistake(
        "hd/resourceRegistry.h",
        r"~HdResourceRegistry\(\);",
        "~HdResourceRegistry() {}",
        r"HdResourceRegistry::~HdResourceRegistry .*: defined here, but the library defines it",
    ),
    "library's key function defined": Mistake(
        "hd/material.h",
        r"~HdMaterial\(\) override;",
        "~HdMaterial() override {}",
        r"HdMaterial: _ZTV\w+ is emitted again",
    ),
    "access wrong": Mistake(
        "hd/material.h",
        r"protected:",
        "public:",
        r"HdMaterial::HdMaterial .*: public, the library's is protected",
    ),
    "dirty bit wrong": Mistake(
        "hd/extComputation.h",
        r"DirtyKernel = 1 << 5",
        "DirtyKernel = 1 << 7",
        r"HdExtComputation::DirtyBits::DirtyKernel: 128, the library's is 32",
    ),
    "class without facts": Mistake(
        "hd/driver.h",
        r"using HdDriverVector",
        "struct HdUnheardOf { int member; };\nusing HdDriverVector",
        r"HdUnheardOf: declared, but not in the facts",
    ),
}

# Mistakes that the declarations' own assertions, or the probe's, turn into compiler errors.
REFUSED = {
    "size": Mistake(
        "hd/instancer.h",
        r"    std::mutex _instanceLock;\n",
        "",
        r"HdInstancer differs in size from the library",
    ),
    "passed in registers": Mistake(
        "hd/types.h",
        r"(    size_t count;\n)",
        r"\1    ~HdTupleType() {}\n",
        r"static assertion failed: HdTupleType",
    ),
    "free function's return type": Mistake(
        "hd/types.h",
        r"size_t HdDataSizeOfFormat",
        "int HdDataSizeOfFormat",
        r"size_t .*HdFormat",
    ),
}


@pytest.fixture(scope="module")
def usd_root() -> Path:
    path = Path(os.environ["MBFEAT_USD_ROOT"])
    if not (path / "lib" / "libusd_ms.so").exists():
        pytest.skip(f"{path} is an OpenUSD SDK: the declarations under test are not used with it")
    return path


@pytest.fixture(scope="module")
def library(usd_root: Path) -> ElfFile:
    return ElfFile(usd_root / "lib" / "libusd_ms.so")


@pytest.fixture(scope="module")
def facts() -> dict[str, Any]:
    return hydra_interface.load_facts(Path(__file__).with_name("hydra_facts.json"))


@pytest.fixture(scope="module")
def probe(
    usd_root: Path, facts: dict[str, Any], root: Path, tmp_path_factory: pytest.TempPathFactory
) -> Probe:
    scratch = tmp_path_factory.mktemp("hydra")
    return hydra_interface.compile_probe(root / HYDRA, usd_root, facts, scratch)


@pytest.fixture(scope="module")
def findings_of_mistakes(
    usd_root: Path,
    facts: dict[str, Any],
    library: ElfFile,
    root: Path,
    tmp_path_factory: pytest.TempPathFactory,
) -> list[str]:
    """What is found in a copy of the declarations that has every one of the mistakes."""
    scratch = tmp_path_factory.mktemp("mistakes")
    copy = _copy_with(MISTAKES, root, scratch)
    wrong = hydra_interface.compile_probe(copy, usd_root, facts, scratch)
    return hydra_interface.findings(wrong, facts, library)


@pytest.fixture(scope="module")
def errors_of_refused(
    usd_root: Path, facts: dict[str, Any], root: Path, tmp_path_factory: pytest.TempPathFactory
) -> str:
    """What the compiler says to a copy of the declarations that it has to refuse."""
    scratch = tmp_path_factory.mktemp("refused")
    copy = _copy_with(REFUSED, root, scratch)
    with pytest.raises(CompileError) as refused:
        hydra_interface.compile_probe(copy, usd_root, facts, scratch)
    return str(refused.value)


def _copy_with(mistakes: dict[str, Mistake], root: Path, scratch: Path) -> Path:
    copy = scratch / "hydra"
    shutil.copytree(root / HYDRA, copy)
    for name, mistake in mistakes.items():
        header = copy / "pxr" / "imaging" / mistake.header
        text, count = re.subn(mistake.right, mistake.wrong, header.read_text(encoding="utf-8"))
        assert count == 1, f"the text of the mistake '{name}' is not in {mistake.header}"
        header.write_text(text, encoding="utf-8")
    return copy


def test_declarations_agree_with_the_library(
    probe: Probe, facts: dict[str, Any], library: ElfFile
) -> None:
    assert hydra_interface.findings(probe, facts, library) == []


def test_every_class_and_function_of_the_folder_is_covered(
    probe: Probe, facts: dict[str, Any], root: Path
) -> None:
    declared = {
        match.group(1)
        for header in (root / HYDRA / "pxr" / "imaging").rglob("*.h")
        for match in re.finditer(
            r"^(?:class|struct) (\w+)[^;{]*\{", header.read_text(encoding="utf-8"), re.MULTILINE
        )
    }
    assert declared, "no class was found in the headers"
    assert declared <= probe.declarations.classes.keys()
    assert probe.declarations.classes.keys() == facts["classes"].keys()
    functions = {function["demangled"].split("(")[0] for function in facts["functions"]}
    assert hydra_interface.declared_functions(root / HYDRA) == functions


@pytest.mark.parametrize("name", MISTAKES)
def test_mistake_is_found(name: str, findings_of_mistakes: list[str]) -> None:
    pattern = MISTAKES[name].finding
    assert any(re.search(pattern, text) for text in findings_of_mistakes), findings_of_mistakes


def test_symbol_that_the_library_lacks_is_found(findings_of_mistakes: list[str]) -> None:
    symbol = "HdLight10IlluminateEv: needed, but not in the library"
    assert any(text.endswith(symbol) for text in findings_of_mistakes), findings_of_mistakes


def test_only_classes_with_mistakes_are_accused(findings_of_mistakes: list[str]) -> None:
    accused = {match[0] for text in findings_of_mistakes if (match := re.match(r"Hd\w+", text))}
    wrong = {Path(mistake.header).stem for mistake in MISTAKES.values()} - {"driver"}
    assert {name.lower() for name in accused} == {f"hd{stem}".lower() for stem in wrong} | {
        "hdunheardof"
    }


@pytest.mark.parametrize("name", REFUSED)
def test_mistake_does_not_compile(name: str, errors_of_refused: str) -> None:
    assert re.search(REFUSED[name].finding, errors_of_refused), errors_of_refused


def test_plugin_needs_only_what_the_library_has(
    build_dir: Path, facts: dict[str, Any], library: ElfFile
) -> None:
    path = build_dir / "plugin" / "usd" / "hdMBFeat.so"
    if not path.exists():
        pytest.skip("the Hydra plug-in is not part of this build")
    plugin = ElfFile(path)
    assert hydra_interface.missing_symbols(plugin, library) == []
    assert hydra_interface.foreign_tables(plugin, facts, library) == []

// What every declaration in this folder rests on.
//
// The folder declares, under the include paths of an OpenUSD SDK, the imaging classes of
// OpenUSD 25.08 that the render delegate touches. No package registry carries the imaging headers;
// the runtime library does carry the classes. So the declarations here are binary descriptions:
// virtual functions in slot order, data members at their offsets, names and parameters as mangled.
// tests/python/test_hydra_conformance.py holds every class against the library. Rules of the
// folder:
//   - virtual functions and destructors that the library defines are declared, never defined, so
//   that
//     vtable and typeinfo stay the library's (a dynamic_cast across the boundary needs one
//     typeinfo);
//   - functions that exist only as inline code in an SDK have a body here;
//   - overloads of a virtual function keep their order: it is their slot order;
//   - a member that only the library uses may be left as bytes, named _opaque...;
//   - static token structs are not declared: their layout changes between releases. Compare by
//   text.
// With a real SDK this folder is not on the include path.
#pragma once

#include "pxr/pxr.h"

#include <string>

// The library was built so; a file built otherwise disagrees with it on VtValue, TfType and
// notices.
#if !defined(PXR_PYTHON_SUPPORT_ENABLED)
#error "define PXR_PYTHON_SUPPORT_ENABLED for every file that includes OpenUSD"
#endif
#if !_GLIBCXX_USE_CXX11_ABI || defined(_GLIBCXX_DEBUG)
#error "the OpenUSD library uses libstdc++'s C++11 strings and containers without debug checks"
#endif

// Default visibility, also when the including target hides its symbols: typeinfo must merge.
#define HYDRA_INTERFACE_OPEN_SCOPE PXR_NAMESPACE_OPEN_SCOPE _Pragma("GCC visibility push(default)")
#define HYDRA_INTERFACE_CLOSE_SCOPE _Pragma("GCC visibility pop") PXR_NAMESPACE_CLOSE_SCOPE

// Size check beside each class; member offsets are checked by the conformance test. A static
// analyser built on Clang reads the sources with another TfHashMap than GCC's (so does Clang
// itself, which therefore must not build the plug-in): there the sizes differ for a known reason.
#if defined(__clang_analyzer__)
#define HYDRA_INTERFACE_SIZE(type, size, align) static_assert(alignof(type) == (align))
#else
#define HYDRA_INTERFACE_SIZE(type, size, align)                                                    \
    static_assert(sizeof(type) == (size), #type " differs in size from the library");              \
    static_assert(alignof(type) == (align), #type " differs in alignment from the library")
#endif

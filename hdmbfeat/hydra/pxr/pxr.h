// Namespace and version macros under the path an OpenUSD SDK has them.
//
// The base libraries' wheels name their macros after each library (TF_INTERNAL_NS, ...), all with
// one value; an SDK calls it PXR_INTERNAL_NS. The compile flag that renames the namespace to the
// runtime's (see the build) applies to both.
#pragma once

#include "pxr/tf/pxr.h"

#define PXR_MAJOR_VERSION TF_MAJOR_VERSION
#define PXR_MINOR_VERSION TF_MINOR_VERSION
#define PXR_PATCH_VERSION TF_PATCH_VERSION
#define PXR_VERSION (PXR_MAJOR_VERSION * 10000 + PXR_MINOR_VERSION * 100 + PXR_PATCH_VERSION)

#define PXR_NS TF_NS
#define PXR_INTERNAL_NS TF_INTERNAL_NS
#define PXR_NS_GLOBAL TF_NS_GLOBAL
#define PXR_NAMESPACE_OPEN_SCOPE TF_NAMESPACE_OPEN_SCOPE
#define PXR_NAMESPACE_CLOSE_SCOPE TF_NAMESPACE_CLOSE_SCOPE
#define PXR_NAMESPACE_USING_DIRECTIVE TF_NAMESPACE_USING_DIRECTIVE

static_assert(PXR_VERSION == 2508, "these declarations describe OpenUSD 25.08 and nothing else");

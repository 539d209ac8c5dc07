#pragma once
#include "pxr/ar/resolverContext.h" // IWYU pragma: export

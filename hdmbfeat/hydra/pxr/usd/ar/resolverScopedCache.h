#pragma once
#include "pxr/ar/resolverScopedCache.h" // IWYU pragma: export

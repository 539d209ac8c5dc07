#pragma once
#include "pxr/ar/resolvedPath.h" // IWYU pragma: export

#pragma once
#include "pxr/ar/resolverContextBinder.h" // IWYU pragma: export

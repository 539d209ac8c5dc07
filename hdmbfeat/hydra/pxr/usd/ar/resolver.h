#pragma once
#include "pxr/ar/resolver.h" // IWYU pragma: export

#pragma once
#include "pxr/gf/math.h" // IWYU pragma: export

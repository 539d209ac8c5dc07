#pragma once
#include "pxr/gf/range3d.h" // IWYU pragma: export

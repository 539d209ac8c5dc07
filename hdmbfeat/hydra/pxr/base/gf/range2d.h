#pragma once
#include "pxr/gf/range2d.h" // IWYU pragma: export

#pragma once
#include "pxr/gf/range1f.h" // IWYU pragma: export

#pragma once
#include "pxr/gf/range1d.h" // IWYU pragma: export

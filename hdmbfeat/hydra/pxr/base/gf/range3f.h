#pragma once
#include "pxr/gf/range3f.h" // IWYU pragma: export

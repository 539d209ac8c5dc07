#pragma once
#include "pxr/gf/range2f.h" // IWYU pragma: export

#pragma once
#include "pxr/gf/vec2h.h" // IWYU pragma: export

#pragma once
#include "pxr/gf/vec2d.h" // IWYU pragma: export

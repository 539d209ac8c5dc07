#pragma once
#include "pxr/gf/vec2f.h" // IWYU pragma: export

#pragma once
#include "pxr/gf/vec3h.h" // IWYU pragma: export

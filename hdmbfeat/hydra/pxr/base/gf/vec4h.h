#pragma once
#include "pxr/gf/vec4h.h" // IWYU pragma: export

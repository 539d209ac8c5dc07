#pragma once
#include "pxr/gf/vec2i.h" // IWYU pragma: export

#pragma once
#include "pxr/gf/vec3f.h" // IWYU pragma: export

#pragma once
#include "pxr/gf/vec3d.h" // IWYU pragma: export

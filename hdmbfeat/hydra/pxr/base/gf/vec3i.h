#pragma once
#include "pxr/gf/vec3i.h" // IWYU pragma: export

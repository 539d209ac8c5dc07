#pragma once
#include "pxr/gf/vec4d.h" // IWYU pragma: export

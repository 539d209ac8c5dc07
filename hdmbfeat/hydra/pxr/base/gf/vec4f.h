#pragma once
#include "pxr/gf/vec4f.h" // IWYU pragma: export

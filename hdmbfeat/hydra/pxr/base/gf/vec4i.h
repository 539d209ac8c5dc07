#pragma once
#include "pxr/gf/vec4i.h" // IWYU pragma: export

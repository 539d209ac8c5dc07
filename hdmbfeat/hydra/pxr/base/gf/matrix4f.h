#pragma once
#include "pxr/gf/matrix4f.h" // IWYU pragma: export

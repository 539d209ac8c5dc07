#pragma once
#include "pxr/gf/matrix3d.h" // IWYU pragma: export

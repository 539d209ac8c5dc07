#pragma once
#include "pxr/gf/matrix2d.h" // IWYU pragma: export

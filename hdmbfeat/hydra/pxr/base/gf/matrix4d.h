#pragma once
#include "pxr/gf/matrix4d.h" // IWYU pragma: export

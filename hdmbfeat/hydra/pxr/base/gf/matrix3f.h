#pragma once
#include "pxr/gf/matrix3f.h" // IWYU pragma: export

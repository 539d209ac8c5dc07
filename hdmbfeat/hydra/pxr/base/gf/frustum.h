#pragma once
#include "pxr/gf/frustum.h" // IWYU pragma: export

#pragma once
#include "pxr/gf/bbox3d.h" // IWYU pragma: export

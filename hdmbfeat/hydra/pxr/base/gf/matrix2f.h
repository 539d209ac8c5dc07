#pragma once
#include "pxr/gf/matrix2f.h" // IWYU pragma: export

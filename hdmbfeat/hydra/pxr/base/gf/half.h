#pragma once
#include "pxr/gf/half.h" // IWYU pragma: export

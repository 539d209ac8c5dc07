#pragma once
#include "pxr/tf/declarePtrs.h" // IWYU pragma: export

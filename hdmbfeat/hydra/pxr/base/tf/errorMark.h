#pragma once
#include "pxr/tf/errorMark.h" // IWYU pragma: export

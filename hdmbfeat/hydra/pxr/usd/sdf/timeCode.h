#pragma once
#include "pxr/sdf/timeCode.h" // IWYU pragma: export

#pragma once
#include "pxr/sdf/types.h" // IWYU pragma: export

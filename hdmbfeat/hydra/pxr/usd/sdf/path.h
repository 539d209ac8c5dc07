#pragma once
#include "pxr/sdf/path.h" // IWYU pragma: export

#pragma once
#include "pxr/sdf/valueTypeName.h" // IWYU pragma: export

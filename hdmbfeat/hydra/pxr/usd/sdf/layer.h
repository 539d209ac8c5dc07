#pragma once
#include "pxr/sdf/layer.h" // IWYU pragma: export

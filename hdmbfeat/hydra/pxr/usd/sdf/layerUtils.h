#pragma once
#include "pxr/sdf/layerUtils.h" // IWYU pragma: export

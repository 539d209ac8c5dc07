#pragma once
#include "pxr/sdf/assetPath.h" // IWYU pragma: export

#pragma once
#include "pxr/ar/asset.h" // IWYU pragma: export

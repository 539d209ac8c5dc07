#pragma once
#include "pxr/tf/pathUtils.h" // IWYU pragma: export

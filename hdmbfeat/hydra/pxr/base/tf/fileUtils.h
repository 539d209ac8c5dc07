#pragma once
#include "pxr/tf/fileUtils.h" // IWYU pragma: export

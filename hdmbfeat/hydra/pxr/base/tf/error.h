#pragma once
#include "pxr/tf/error.h" // IWYU pragma: export

#pragma once
#include "pxr/tf/debug.h" // IWYU pragma: export

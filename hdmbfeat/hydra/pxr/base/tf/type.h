#pragma once
#include "pxr/tf/type.h" // IWYU pragma: export

#pragma once
#include "pxr/tf/refPtr.h" // IWYU pragma: export
